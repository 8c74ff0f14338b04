// Child process that switches off a device's force when this process dies.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace palpate {

/// Waits on a pipe that only this process can write to. If the pipe ends without a goodbye, because this
/// process was killed, crashed or was aborted, the child opens the last device named to it and writes that
/// device's reports for zero force. It accepts no signal except SIGKILL, and has a session of its own.
///
/// It cannot help against a process that hangs or a machine that stops; the device's own watchdog covers
/// these.
class Guardian {
 public:
  /// Forks; call it before the program has a second thread. Throws Error if the fork fails.
  Guardian();
  /// Sends the goodbye and waits for the child to exit.
  ~Guardian();
  Guardian(const Guardian&) = delete;
  Guardian& operator=(const Guardian&) = delete;

  /// Guards `path` from now on. `reports`: output reports after which there is no force (at most 8 of at most
  /// 64 bytes, as write(2) on a hidraw device takes them; others are left out). Without reports, the same as
  /// release().
  void guard(const std::string& path, std::span<const std::vector<std::uint8_t>> reports) noexcept;

  /// Guards nothing any more: the device was closed without force.
  void release() noexcept;

 private:
  int pipe_ = -1;
  pid_t child_ = -1;
};

}  // namespace palpate
