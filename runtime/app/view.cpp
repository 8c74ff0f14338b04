#include "runtime/app/view.h"

#include <fmt/core.h>
#include <signal.h>

#include <deque>
#include <utility>

#include "base/error.h"
#include "base/interrupt.h"
#include "base/program.h"
#include "runtime/app/session_pictures.h"
#include "runtime/app/session_view.h"
#include "runtime/gallery/gallery_folder.h"
#include "runtime/gallery/gallery_server.h"
#include "runtime/viewer/viewer_server.h"

namespace palpate {
namespace {

/// Prints the address and serves until one of the signals.
void serve(const ServedAddress& served, const std::string& url, const sigset_t& ends) {
  tell_address(served, url, "; Ctrl-C ends");
  int signal = 0;
  sigwait(&ends, &signal);
  end_soon(nullptr);
}

void view_folder(const std::filesystem::path& folder, const ViewerOptions& options, const sigset_t& ends) {
  const std::size_t items = list_gallery(folder).size();
  const std::filesystem::path place = std::filesystem::canonical(folder);
  const GalleryServer server(place, options);
  say(stderr, "{}: {} to choose from\n", place, items);
  serve(server.served(), server.url(), ends);
}

void view_recordings(const std::vector<std::filesystem::path>& recordings, ViewerOptions options,
                     const sigset_t& ends) {
  std::deque<SessionView> sessions;  // first: a broken file is reported even if the port is in use
  std::vector<RunToShow> runs;
  runs.reserve(recordings.size());
  for (const std::filesystem::path& recording : recordings)
    runs.push_back({sessions.emplace_back(recording), true});
  options.shows = recordings;
  ViewerPort port(options);
  const ServedAddress served = port.served();
  ViewerServer server(std::move(port), runs);
  for (std::size_t k = 0; k < sessions.size(); ++k) {
    sessions[k].show(server, k);
    const SessionPictures& pictures = sessions[k].pictures();
    say(stderr, "{}: {} pictures, {:.3f} s\n", recordings[k], pictures.frames(),
        pictures.time(pictures.frames() - 1));
  }
  serve(served, server.url(), ends);
}

}  // namespace

int view(const std::vector<std::filesystem::path>& files, ViewerOptions options) {
  sigset_t ends;  // blocked before the server's thread starts, which inherits the mask
  sigemptyset(&ends);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&ends, signal);
  pthread_sigmask(SIG_BLOCK, &ends, nullptr);
  std::error_code problem;
  if (files.empty() || (files.size() == 1 && std::filesystem::is_directory(files.front(), problem))) {
    view_folder(files.empty() ? "." : files.front(), options, ends);
  } else {
    view_recordings(files, std::move(options), ends);
  }
  return exit_ok;
}

}  // namespace palpate
