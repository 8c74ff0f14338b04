#include "formats/shrunk_file.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <string_view>

#include "base/error.h"
#include "base/file_io.h"

namespace palpate {
namespace {

// Only functions that signal handlers may call.
void end(int, siginfo_t* info, void*) {
  std::array<char, 1024> text;
  std::size_t size = 0;
  const auto add = [&](std::string_view piece) {
    size += piece.copy(text.data() + size, text.size() - size);
  };
  const char* const file = mapped_file_at(info->si_addr);
  add("error: ");
  add(file != nullptr ? file : "a file");
  add(file != nullptr ? ": " : " ");
  add("was cut off while it was in use, or its disk failed (bus error)\n"
      "hint: Leave files alone while a program reads them, and start it again\n");
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, text.data(), size);
  ::_exit(exit_input_error);
}

}  // namespace

void end_with_an_error_on_shrunk_files() {
  struct sigaction action {};
  action.sa_sigaction = end;
  action.sa_flags = SA_SIGINFO;
  sigaction(SIGBUS, &action, nullptr);
}

}  // namespace palpate
