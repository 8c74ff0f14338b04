#include "runtime/devices/hid/guardian.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstring>

#include "base/error.h"
#include "base/limits/descriptors.h"

namespace palpate {
namespace {

/// Message to the child, sent in one write: a pipe keeps writes of up to PIPE_BUF bytes whole. A message
/// without reports leaves the child nothing to do; it is also the goodbye.
struct Message {
  static constexpr std::size_t most_reports = 8;
  static constexpr std::size_t room = 64;

  std::array<char, 256> path{};
  std::uint8_t count = 0;
  std::array<std::uint8_t, most_reports> sizes{};
  std::array<std::array<std::uint8_t, room>, most_reports> reports{};
};
static_assert(sizeof(Message) <= PIPE_BUF);

void tell(int pipe, const Message& message) noexcept {
  while (write(pipe, &message, sizeof(message)) < 0 && errno == EINTR) {
  }
}

// --- the child: async-signal-safe functions alone, since locks of other threads are not released here ---

/// Reads a message; false at the end of the pipe.
bool receive(int pipe, Message& message) noexcept {
  auto* const bytes = reinterpret_cast<unsigned char*>(&message);
  std::size_t have = 0;
  while (have < sizeof(message)) {
    const ssize_t more = read(pipe, bytes + have, sizeof(message) - have);
    if (more > 0) have += static_cast<std::size_t>(more);
    if (more == 0 || (more < 0 && errno != EINTR)) return false;
  }
  return true;
}

void show_no_force(const Message& device) noexcept {
  const int file = open(device.path.data(), O_WRONLY | O_CLOEXEC);
  if (file < 0) return;
  for (std::size_t k = 0; k < device.count; ++k) {
    // Twice, as one may be lost. After an error the next report is still worth sending.
    for (int time = 0; time < 2; ++time) {
      if (write(file, device.reports[k].data(), device.sizes[k]) < 0 && errno == EINTR) --time;
    }
  }
  close(file);
}

/// Detaches from the terminal and the files of the guarded process, so that a program that waits for the end
/// of its output does not wait for the child. Closes the other end of the pipe too.
void detach(int& pipe) noexcept {
  setsid();
  constexpr int own = 3;
  pipe = fcntl(pipe, F_DUPFD, own);  // it may be one of the first three if the parent had closed them
  const int null = open("/dev/null", O_RDWR);
  for (int file = 0; file < own; ++file) {
    if (null >= 0) {
      dup2(null, file);
    } else {
      close(file);
    }
  }
  if (pipe != own) pipe = dup2(pipe, own);
  close_descriptors(own + 1, INT_MAX);
  static_cast<void>(!chdir("/"));
}

[[noreturn]] void watch(int pipe) noexcept {
  detach(pipe);
  Message last;
  Message message;
  while (receive(pipe, message)) {
    last = message;
  }
  if (last.count > 0) show_no_force(last);
  _exit(0);
}

}  // namespace

Guardian::Guardian() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw Error(std::string("no pipe: ") + std::strerror(errno), "guardian", "close other programs");
  }
  // The child keeps all signals blocked.
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  child_ = fork();
  if (child_ == 0) watch(ends[0]);
  const int reason = errno;
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  close(ends[0]);
  if (child_ < 0) {
    close(ends[1]);
    throw Error(std::string("no second process: ") + std::strerror(reason), "guardian",
                "close other programs");
  }
  pipe_ = ends[1];
}

Guardian::~Guardian() {
  release();
  close(pipe_);
  while (waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

void Guardian::guard(const std::string& path, std::span<const std::vector<std::uint8_t>> reports) noexcept {
  Message message;
  if (path.size() >= message.path.size()) return;
  std::ranges::copy(path, message.path.begin());
  for (const std::vector<std::uint8_t>& report : reports) {
    if (message.count == Message::most_reports || report.size() > Message::room) continue;
    std::ranges::copy(report, message.reports[message.count].begin());
    message.sizes[message.count++] = static_cast<std::uint8_t>(report.size());
  }
  tell(pipe_, message);
}

void Guardian::release() noexcept {
  tell(pipe_, {});
}

}  // namespace palpate
