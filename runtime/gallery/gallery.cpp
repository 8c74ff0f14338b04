#include "runtime/gallery/gallery.h"

#include <fmt/core.h>
#include <signal.h>

#include "base/error.h"
#include "base/interrupt.h"
#include "base/program.h"
#include "runtime/gallery/gallery_folder.h"
#include "runtime/gallery/gallery_server.h"

namespace palpate {

int show_gallery(const std::filesystem::path& folder, const ViewerOptions& options) {
  sigset_t ends;  // blocked before the server's thread starts, which inherits the mask
  sigemptyset(&ends);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&ends, signal);
  pthread_sigmask(SIG_BLOCK, &ends, nullptr);
  const std::size_t items = list_gallery(folder).size();
  const std::filesystem::path place = std::filesystem::canonical(folder);
  const GalleryServer server(place, options);
  say(stderr, "{}: {} to choose from\n", place, items);
  tell_address(server.served(), server.url(), "; Ctrl-C ends");
  int signal = 0;
  sigwait(&ends, &signal);
  end_soon(nullptr);
  return exit_ok;
}

}  // namespace palpate
