// Ctrl-C, or a batch system's signal, while a file is being made.
#pragma once

#include <array>
#include <csignal>

namespace palpate {

/// While it lives, SIGINT, SIGTERM and SIGUSR1 end the process with exit_interrupted: at first at once, as
/// there is nothing to keep, and after `note_from_now_on` by being noted, so that a block of columns is
/// written whole and the person is told how to go on. One at a time.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  void note_from_now_on() noexcept;
  [[nodiscard]] bool requested() const noexcept;

 private:
  static constexpr std::array<int, 3> signals = {SIGINT, SIGTERM, SIGUSR1};
  std::array<struct sigaction, signals.size()> before_{};
};

}  // namespace palpate
