#include "base/program.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <string_view>
#include <system_error>

#include "base/error.h"
#include "base/file_io.h"

namespace palpate {
namespace {

void prepare_output() {
  std::signal(SIGXFSZ, SIG_IGN);
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(fd, F_GETFD) < 0) (void)::open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
  const auto write_or_lose = [](void*, const char* bytes, std::size_t size) -> ssize_t {
    (void)write_all(STDERR_FILENO, {bytes, size});
    return static_cast<ssize_t>(size);
  };
  std::FILE* stream = ::fopencookie(
      nullptr, "w", {.read = nullptr, .write = write_or_lose, .seek = nullptr, .close = nullptr});
  if (stream == nullptr) return;
  std::setvbuf(stream, nullptr, _IONBF, 0);
  stderr = stream;  // the GNU C library allows this assignment
}

void tell(const Error& error) {
  std::fputs(to_text(error).c_str(), stderr);
}

/// Flushes standard output, reports it if some of it was lost, and returns the exit status.
int finish_output(int status) {
  const bool failed_before = std::ferror(stdout) != 0;
  errno = 0;
  const bool flushed = std::fflush(stdout) == 0;
  if (flushed && !failed_before) return status;
  tell({"cannot be written" + (flushed ? "" : ": " + std::generic_category().message(errno)) +
            ": some of what was printed is lost",
        "standard output", "free some disk space, or send it elsewhere"});
  return status == exit_ok ? exit_input_error : status;
}

int run_and_tell(const std::string& name, const std::string& if_no_memory, const std::function<int()>& body) {
  try {
    return body();
  } catch (const Error& error) {
    tell(error);
  } catch (...) {
    // finish_output reports what fmt throws when standard output is full.
    if (std::ferror(stdout) == 0) tell(handled_error(name, if_no_memory));
  }
  return exit_input_error;
}

// Only functions that signal handlers may call.
void end_at_bus_error(int, siginfo_t* info, void*) {
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
  action.sa_sigaction = end_at_bus_error;
  action.sa_flags = SA_SIGINFO;
  sigaction(SIGBUS, &action, nullptr);
}

int run_program(const std::string& name, const std::string& if_no_memory, const std::function<int()>& body) {
  prepare_output();
  return finish_output(run_and_tell(name, if_no_memory, body));
}

int tell_usage(const std::string& what, const std::string& hint) {
  tell({what, "", hint});
  return exit_usage;
}

}  // namespace palpate
