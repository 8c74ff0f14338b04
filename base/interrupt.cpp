#include "base/interrupt.h"

#include <atomic>

namespace palpate {
namespace {

std::atomic<bool> signalled{false};  // what a signal handler can reach

}  // namespace

InterruptGuard::InterruptGuard() {
  signalled = false;
  struct sigaction action {};
  action.sa_handler = [](int) { signalled = true; };
  sigaction(SIGINT, &action, &old_interrupt_);
  sigaction(SIGTERM, &action, &old_terminate_);
}

InterruptGuard::~InterruptGuard() {
  sigaction(SIGINT, &old_interrupt_, nullptr);
  sigaction(SIGTERM, &old_terminate_, nullptr);
}

bool InterruptGuard::requested() const noexcept {
  return signalled;
}

}  // namespace palpate
