#include "base/interrupt.h"

#include <unistd.h>

#include <atomic>
#include <cstddef>

#include "base/error.h"

namespace palpate {
namespace {

constexpr char ending[] = "\ninterrupted: no columns were computed\n";

// What a signal handler can reach.
std::atomic<bool> signalled{false};
std::atomic<bool> noted_only{false};
std::atomic<pid_t> owner{0};  // a child that was forked is silent

void handle(int) {
  signalled = true;
  if (noted_only) return;
  if (::getpid() == owner) [[maybe_unused]]
    const ssize_t written = ::write(STDERR_FILENO, ending, sizeof ending - 1);
  ::_exit(exit_interrupted);
}

}  // namespace

InterruptGuard::InterruptGuard() {
  signalled = false;
  noted_only = false;
  owner = ::getpid();
  struct sigaction action {};
  action.sa_handler = handle;
  for (std::size_t k = 0; k < signals.size(); ++k) sigaction(signals[k], &action, &before_[k]);
}

InterruptGuard::~InterruptGuard() {
  for (std::size_t k = 0; k < signals.size(); ++k) sigaction(signals[k], &before_[k], nullptr);
}

void InterruptGuard::note_from_now_on() noexcept {
  noted_only = true;
}

bool InterruptGuard::requested() const noexcept {
  return signalled;
}

}  // namespace palpate
