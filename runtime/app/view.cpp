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
#include "runtime/viewer/viewer_server.h"

namespace palpate {

int view(const std::vector<std::filesystem::path>& recordings, ViewerOptions options) {
  sigset_t ends;  // blocked before the server's thread starts, which inherits the mask
  sigemptyset(&ends);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&ends, signal);
  pthread_sigmask(SIG_BLOCK, &ends, nullptr);
  std::deque<SessionView> sessions;  // first: a broken file is reported even if the port is in use
  std::vector<RunToShow> runs;
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
  tell_address(served, server.url(), "; Ctrl-C ends");
  int signal = 0;
  sigwait(&ends, &signal);
  end_soon(nullptr);
  return exit_ok;
}

}  // namespace palpate
