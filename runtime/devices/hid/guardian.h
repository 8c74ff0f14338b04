// A child process that takes the force off a device when this process dies.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace palpate {

/// Waits on a pipe that only this process can write to. When the pipe ends without a goodbye, because this
/// process was killed, crashed or was aborted, it opens the device that it was told of last and writes its
/// reports of no force. It takes no signal but SIGKILL, and has a session of its own.
///
/// What it cannot help against: a process that hangs, and a machine that stops. The device's own watchdog
/// is for these.
class Guardian {
 public:
  /// Forks: before the program has a second thread. Throws Error when that fails.
  Guardian();
  /// Says goodbye and waits for the child's end.
  ~Guardian();
  Guardian(const Guardian&) = delete;
  Guardian& operator=(const Guardian&) = delete;

  /// From now on `path`, with the output reports after which there is no force (at most 8 of at most 64
  /// bytes, as write(2) on a hidraw device takes them; more are left out). Without reports as release().
  void guard(const std::string& path, std::span<const std::vector<std::uint8_t>> reports) noexcept;

  /// There is nothing to guard: the device was closed without force.
  void release() noexcept;

 private:
  int pipe_ = -1;
  pid_t child_ = -1;
};

}  // namespace palpate
