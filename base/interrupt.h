// Handling of Ctrl-C and of a batch system's signals while a file is written.
#pragma once

#include <array>
#include <csignal>
#include <string>

namespace palpate {

/// Ends the process with exit_interrupted in 1.9 s if it still runs then, whatever it hangs in, and prints
/// `text` (nullptr: nothing), which must live until then. Async-signal-safe. Takes SIGALRM.
void end_soon(const char* text) noexcept;

/// While it lives, SIGINT, SIGTERM and SIGUSR1 end the process with exit_interrupted. At first they end it at
/// once, as there is nothing to keep. After `note_from_now_on` they set a flag, so that a block of columns is
/// written whole and the user learns how to continue; a process that hangs is then ended by end_soon, except
/// after SIGUSR1, which a batch system sends long before it kills. One instance at a time.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  /// Has this file removed, if it is empty, when a signal ends the process.
  void remove_if_empty(const std::string& file);
  /// Lets signals set a flag from now on. `text` is printed if the run does not end by itself; empty: it may
  /// take as long as it needs.
  void note_from_now_on(const std::string& text);
  [[nodiscard]] bool requested() const noexcept;

 private:
  static constexpr std::array<int, 3> signals = {SIGINT, SIGTERM, SIGUSR1};
  std::array<struct sigaction, signals.size()> before_{};
};

}  // namespace palpate
