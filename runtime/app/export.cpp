#include "runtime/app/export.h"

#include <fmt/core.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/json_text.h"
#include "base/words.h"
#include "base/write_file.h"
#include "formats/outputs/output_paths.h"
#include "formats/recording_parts.h"
#include "runtime/app/session_pictures.h"
#include "runtime/exports/gltf.h"
#include "runtime/exports/ticks_table.h"
#include "runtime/loop/session_check.h"
#include "runtime/scene/seen_surface.h"
#include "runtime/viewer/page_archive.h"
#include "runtime/viewer/run_words.h"
#include "runtime/viewer/wire.h"
#include "runtime/web/page.h"

namespace palpate {
namespace {

/// One in so many of a page's pictures is whole; from it the page makes those after it that it jumps to.
constexpr std::size_t pictures_per_whole = 30;

/// Pictures of a glTF scene: each is a morph target, and each has a weight at the time of each.
constexpr std::size_t most_targets = 1000;

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

/// A recording's pictures that are written.
struct Chosen {
  const SessionPictures& pictures;
  std::vector<std::int64_t> frames;

  [[nodiscard]] double seconds() const {
    return pictures.time(frames.back()) - pictures.time(frames.front());
  }
  [[nodiscard]] std::vector<SurfacePicture> read() const {
    std::vector<SurfacePicture> all;
    for (const std::int64_t frame : frames) all.push_back(pictures.picture(frame));
    return all;
  }
};

std::string html_page(const Chosen& chosen) {
  const SessionPictures& pictures = chosen.pictures;
  std::vector<double> times;
  times.reserve(chosen.frames.size());
  for (const std::int64_t frame : chosen.frames) times.push_back(pictures.time(frame));

  PageArchive archive;
  archive.add_text(hello_word("file", 0));
  const Scene scene = pictures.scene();
  const StateWord state(json_text(pictures.state(times)));
  archive.add_text(state.for_page(scene.number, {}, state.times()));
  archive.add_binary(encode_scene(scene));
  for (const TickRun& run : pictures.ticks())
    archive.add_binary(encode_ticks(scene.number, run.notes, run.stride));
  std::optional<WireValues> base;
  for (std::size_t k = 0; k < chosen.frames.size(); ++k) {
    const SurfacePicture picture = pictures.picture(chosen.frames[k]);
    WireValues values = wire_values(picture, scene, nullptr, static_cast<std::uint32_t>(k + 1));
    const bool is_whole = k % pictures_per_whole == 0;
    archive.add_binary(encode_frame(picture, scene, nullptr, values, is_whole ? nullptr : &*base));
    base = std::move(values);
  }
  return archive.page(viewer_page());
}

void tell(const std::filesystem::path& file, const Chosen& chosen, std::size_t bytes) {
  fmt::print(stderr, "{}: {} pictures, {:.1f} s, {:.1f} MB\n", file.string(), chosen.frames.size(),
             chosen.seconds(), 1e-6 * static_cast<double>(bytes));
}

/// "00042.vtu"
std::string frame_name(std::size_t number) {
  return fmt::format("{:05}.vtu", number);
}

/// The collection (.pvd) of pictures that lie in `folder` beside it, with their times.
std::string series_pvd(const std::filesystem::path& folder, std::span<const SurfacePicture> pictures) {
  std::string text = "<?xml version=\"1.0\"?>\n<!-- palpate " PALPATE_VERSION
                     " -->\n<VTKFile type=\"Collection\" "
                     "version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>\n";
  for (std::size_t k = 0; k < pictures.size(); ++k) {
    text += fmt::format("<DataSet timestep=\"{}\" file=\"{}\"/>\n", pictures[k].frame.time,
                        xml_escaped((folder / frame_name(k)).string()));
  }
  return text + "</Collection>\n</VTKFile>\n";
}

/// The pictures of a series, in a folder beside the collection.
std::filesystem::path frames_folder(const std::filesystem::path& pvd) {
  std::filesystem::path folder = pvd;
  return folder.replace_extension(".frames");
}

/// Throws Error where the folder is a file, or has files that an earlier series did not put there.
void expect_only_frames(const std::filesystem::path& folder, bool force) {
  if (!std::filesystem::exists(folder)) return;
  if (!std::filesystem::is_directory(folder))
    throw Error("is a file, where the pictures' folder is to be", folder.string(), "name another --vtu file");
  if (force) return;
  std::size_t count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder)) ++count;
  for (std::size_t k = 0; k < count; ++k) {
    if (!std::filesystem::exists(folder / frame_name(k)))
      throw Error("has files that are no pictures of a series", folder.string(),
                  "name another file, or give --force to put the pictures beside them");
  }
}

/// Returns the bytes of all pictures.
std::size_t write_series(const std::filesystem::path& pvd, const Scene& scene,
                         std::span<const SurfacePicture> pictures) {
  const std::filesystem::path folder = frames_folder(pvd);
  std::size_t bytes = 0;
  std::error_code reason;
  std::filesystem::create_directory(folder, reason);
  if (reason) throw Error("cannot be made: " + reason.message(), folder.string(), "write elsewhere");
  for (std::size_t k = 0; k < pictures.size(); ++k) {
    const std::string text = surface_vtu(pictures[k], scene, nullptr);
    write_file(folder / frame_name(k), text);
    bytes += text.size();
  }
  for (std::size_t k = pictures.size(); std::filesystem::remove(folder / frame_name(k)); ++k) {
  }  // of a longer series before
  write_file(pvd, series_pvd(folder.filename(), pictures));
  return bytes;
}

/// The ticks from options.from to options.to.
void write_ticks(const ExportOptions& options, const std::filesystem::path& csv) {
  const Recording recording = read_session(options.recording);
  std::vector<TickRecord> ticks;
  for (const TickRecord& tick : recording.ticks) {
    if (tick.time >= options.from && (!options.to || tick.time <= *options.to)) ticks.push_back(tick);
  }
  if (ticks.empty())
    throw Error("has no ticks in that time", options.recording.string(),
                "palpate-runtime session tells how long it is");
  write_file(csv, ticks_table(ticks));
  fmt::print(stderr, "{}: {} ticks\n", options.csv.string(), ticks.size());
}

}  // namespace

int export_session(const ExportOptions& options) {
  OutputPaths paths(options.force);
  paths.add_input(options.recording, "the recording");
  paths.add_input(parts_folder(options.recording), "the recording's parts");
  const auto output = [&](const std::filesystem::path& file, OutputKind kind, const char* option) {
    return file.empty() ? file : paths.add(file, kind, option);
  };
  const std::filesystem::path html = output(options.html, OutputKind::page, "--html"),
                              gltf = output(options.gltf, OutputKind::scene, "--gltf"),
                              vtu = output(options.vtu, OutputKind::series, "--vtu"),
                              csv = output(options.csv, OutputKind::ticks, "--csv");
  if (!vtu.empty()) expect_only_frames(frames_folder(vtu), options.force);
  if (!csv.empty()) write_ticks(options, csv);
  if (html.empty() && gltf.empty() && vtu.empty()) return exit_ok;

  const SessionPictures pictures(options.recording);
  const Chosen chosen{pictures, choose(pictures, options)};
  if (!html.empty()) {
    const std::string page = html_page(chosen);
    write_file(html, page);
    tell(options.html, chosen, page.size());
  }
  if (gltf.empty() && vtu.empty()) return exit_ok;
  const std::vector<SurfacePicture> all = chosen.read();
  if (!gltf.empty()) {
    if (chosen.frames.size() > most_targets) {
      throw Error(
          fmt::format("{} pictures were asked for as glTF", chosen.frames.size()), options.recording.string(),
          fmt::format("ask for at most {} by a lower --fps, or a part by --from and --to", most_targets));
    }
    const std::string scene = glb_of(pictures.name(), pictures.surface(), pictures.tool(), all);
    write_file(gltf, scene);
    tell(options.gltf, chosen, scene.size());
  }
  if (!vtu.empty()) tell(options.vtu, chosen, write_series(vtu, pictures.scene(), all));
  return exit_ok;
}

}  // namespace palpate
