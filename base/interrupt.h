// Ctrl-C while a file is being written.
#pragma once

#include <csignal>

namespace palpate {

/// While it lives, SIGINT and SIGTERM are noted instead of ending the process, so that a block of columns is
/// written whole and the person is told how to go on. Before and after they end it at once. One at a time.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  [[nodiscard]] bool requested() const noexcept;

 private:
  struct sigaction old_interrupt_ {};
  struct sigaction old_terminate_ {};
};

}  // namespace palpate
