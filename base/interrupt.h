// Ctrl-C, or a batch system's signal, while a file is being made.
#pragma once

#include <array>
#include <csignal>
#include <string>

namespace palpate {

/// Ends the process with exit_interrupted if it is still there in 1.9 s, whatever it hangs in then; `text`
/// (nullptr: nothing), which must stay, is printed. Signal handlers may call it. Takes SIGALRM.
void end_soon(const char* text) noexcept;

/// While it lives, SIGINT, SIGTERM and SIGUSR1 end the process with exit_interrupted: at first at once, as
/// there is nothing to keep, and after `note_from_now_on` by being noted, so that a block of columns is
/// written whole and the person is told how to go on; what hangs then is ended by end_soon, unless the signal
/// was SIGUSR1, which a batch system sends long before it kills. One at a time.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  /// Where a signal ends the process, this file is removed if it is empty.
  void remove_if_empty(const std::string& file);
  /// `text` is printed where the run does not end by itself. Empty: it may take as long as it needs.
  void note_from_now_on(const std::string& text);
  [[nodiscard]] bool requested() const noexcept;

 private:
  static constexpr std::array<int, 3> signals = {SIGINT, SIGTERM, SIGUSR1};
  std::array<struct sigaction, signals.size()> before_{};
};

}  // namespace palpate
