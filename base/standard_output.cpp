#include "base/standard_output.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>

#include "base/error.h"

namespace palpate {

void prepare_output() noexcept {
  std::signal(SIGXFSZ, SIG_IGN);
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(fd, F_GETFD) < 0) (void)::open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
  const auto write_or_lose = [](void*, const char* bytes, std::size_t size) -> ssize_t {
    for (std::size_t done = 0; done < size;) {
      const ssize_t put = ::write(STDERR_FILENO, bytes + done, size - done);
      if (put < 0 && errno == EINTR) continue;
      if (put <= 0) break;
      done += static_cast<std::size_t>(put);
    }
    return static_cast<ssize_t>(size);
  };
  std::FILE* stream = ::fopencookie(
      nullptr, "w", {.read = nullptr, .write = write_or_lose, .seek = nullptr, .close = nullptr});
  if (stream == nullptr) return;
  std::setvbuf(stream, nullptr, _IONBF, 0);
  stderr = stream;  // which the GNU C library lets a program do
}

int finish_output(int status) noexcept {
  const bool failed_before = std::ferror(stdout) != 0;
  errno = 0;
  const bool flushed = std::fflush(stdout) == 0;
  if (flushed && !failed_before) return status;
  std::fprintf(stderr,
               "error: standard output: cannot be written%s%s: some of what was printed is lost\n"
               "hint: Free some disk space, or send it elsewhere.\n",
               flushed ? "" : ": ", flushed ? "" : std::strerror(errno));
  return status == exit_ok ? exit_input_error : status;
}

}  // namespace palpate
