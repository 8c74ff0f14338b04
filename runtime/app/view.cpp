#include "runtime/app/view.h"

#include <fmt/core.h>
#include <signal.h>

#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/json_text.h"
#include "base/write_file.h"
#include "formats/outputs/output_paths.h"
#include "formats/recording_parts.h"
#include "runtime/app/session_pictures.h"
#include "runtime/app/session_view.h"
#include "runtime/viewer/page_archive.h"
#include "runtime/viewer/run_words.h"
#include "runtime/viewer/viewer_server.h"
#include "runtime/viewer/wire.h"
#include "runtime/web/page.h"

namespace palpate {
namespace {

/// One in so many of a page's pictures is whole; from it the page makes those after it that it jumps to.
constexpr std::size_t pictures_per_whole = 30;

/// Numbers of the frames that go into the page.
std::vector<std::int64_t> choose(const SessionPictures& pictures, const ExportOptions& options) {
  std::vector<std::int64_t> chosen;
  const double spacing = (1.0 - 1e-6) / options.fps;
  for (std::int64_t k = 0; k < pictures.frames(); ++k) {
    const double time = pictures.time(k);
    if (time < options.from || (options.to && time > *options.to)) continue;
    if (chosen.empty() || time - pictures.time(chosen.back()) >= spacing) chosen.push_back(k);
  }
  if (chosen.empty()) {
    throw Error(
        fmt::format("has no pictures from {:g} s on{}", options.from,
                    options.to ? fmt::format(" to {:g} s", *options.to) : ""),
        options.recording.string(),
        fmt::format("it lasts from {:g} to {:g} s", pictures.time(0), pictures.time(pictures.frames() - 1)));
  }
  return chosen;
}

}  // namespace

int view(const std::vector<std::filesystem::path>& recordings, const ViewerOptions& options) {
  sigset_t ends;  // blocked before the server's thread begins, which inherits that
  sigemptyset(&ends);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&ends, signal);
  pthread_sigmask(SIG_BLOCK, &ends, nullptr);
  std::deque<SessionView> sessions;  // first: a broken file is told even where the port is taken
  std::vector<RunToShow> runs;
  for (const std::filesystem::path& recording : recordings)
    runs.push_back({sessions.emplace_back(recording), true});
  ViewerServer server(ViewerPort(options), runs);
  for (std::size_t k = 0; k < sessions.size(); ++k) {
    sessions[k].show(server, k);
    const SessionPictures& pictures = sessions[k].pictures();
    fmt::print(stderr, "{}: {} pictures, {:.3f} s\n", recordings[k].string(), pictures.frames(),
               pictures.time(pictures.frames() - 1));
  }
  fmt::print(stderr, "open {} in a browser; Ctrl-C ends\n", server.url());
  int signal = 0;
  sigwait(&ends, &signal);
  return exit_ok;
}

int export_html(const ExportOptions& options) {
  OutputPaths paths(options.force);
  paths.add_input(options.recording, "the recording");
  paths.add_input(parts_folder(options.recording), "the recording's parts");
  const std::filesystem::path html = paths.add(options.html, OutputKind::page, "--html");
  const SessionPictures pictures(options.recording);
  const std::vector<std::int64_t> chosen = choose(pictures, options);
  std::vector<double> times;
  times.reserve(chosen.size());
  for (const std::int64_t frame : chosen) times.push_back(pictures.time(frame));

  PageArchive archive;
  archive.add_text(hello_word("file", 0));
  const Scene scene = pictures.scene();
  const StateWord state(json_text(pictures.state(times)));
  archive.add_text(state.for_page(scene.number, {}, state.times()));
  archive.add_binary(encode_scene(scene));
  for (const TickRun& run : pictures.ticks())
    archive.add_binary(encode_ticks(scene.number, run.notes, run.stride));
  std::optional<WireValues> base;
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const SurfacePicture picture = pictures.picture(chosen[k]);
    WireValues values = wire_values(picture, scene, nullptr, static_cast<std::uint32_t>(k + 1));
    const bool is_whole = k % pictures_per_whole == 0;
    archive.add_binary(encode_frame(picture, scene, nullptr, values, is_whole ? nullptr : &*base));
    base = std::move(values);
  }
  const std::string page = archive.page(viewer_page());
  write_file(html, page);
  fmt::print(stderr, "{}: {} pictures, {:.1f} s, {:.1f} MB\n", options.html.string(), chosen.size(),
             times.back() - times.front(), 1e-6 * static_cast<double>(page.size()));
  return exit_ok;
}

}  // namespace palpate
