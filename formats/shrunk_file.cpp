#include "formats/shrunk_file.h"

#include <unistd.h>

#include <csignal>
#include <string_view>

#include "base/error.h"

namespace palpate {
namespace {

void end(int) {
  constexpr std::string_view text =
      "error: a file was cut off while it was in use\nhint: Leave files alone while a program reads them, "
      "and "
      "start it again\n";
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, text.data(), text.size());
  ::_exit(exit_input_error);
}

}  // namespace

void end_with_an_error_on_shrunk_files() {
  struct sigaction action {};
  action.sa_handler = end;
  sigaction(SIGBUS, &action, nullptr);
}

}  // namespace palpate
