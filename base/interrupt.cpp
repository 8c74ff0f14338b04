#include "base/interrupt.h"

#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>

#include <atomic>
#include <cstddef>
#include <cstring>

#include "base/error.h"

namespace palpate {
namespace {

constexpr char ending[] = "\ninterrupted: no columns were computed\n";

// State that the signal handler reads.
std::atomic<bool> signalled{false};
std::atomic<bool> noted_only{false};
std::atomic<pid_t> owner{0};  // a child that was forked is silent
std::atomic<const char*> late_text{nullptr};
std::string kept_text;  // of the guard, which late_text points to
std::atomic<const char*> begun_file{nullptr};
std::string kept_file;  // of the guard, which begun_file points to

void remove_begun_file() {
  struct stat begun = {};
  const char* const file = begun_file;
  if (file != nullptr && ::stat(file, &begun) == 0 && begun.st_size == 0) ::unlink(file);
}

void end_late(int) {
  remove_begun_file();
  if (const char* const text = late_text; text != nullptr) [[maybe_unused]]
    const ssize_t written = ::write(STDERR_FILENO, text, std::strlen(text));
  ::_exit(exit_interrupted);
}

void handle(int signal) {
  signalled = true;
  if (noted_only) {
    if (signal != SIGUSR1 && late_text != nullptr) end_soon(late_text);
    return;
  }
  if (::getpid() == owner) {
    remove_begun_file();
    [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, ending, sizeof ending - 1);
  }
  ::_exit(exit_interrupted);
}

}  // namespace

void end_soon(const char* text) noexcept {
  late_text = text;
  struct sigaction action {};
  action.sa_handler = end_late;
  sigaction(SIGALRM, &action, nullptr);
  const itimerval patience{{}, {1, 900'000}};
  ::setitimer(ITIMER_REAL, &patience, nullptr);
}

InterruptGuard::InterruptGuard() {
  signalled = false;
  noted_only = false;
  late_text = nullptr;
  owner = ::getpid();
  struct sigaction action {};
  action.sa_handler = handle;
  for (std::size_t k = 0; k < signals.size(); ++k) sigaction(signals[k], &action, &before_[k]);
}

InterruptGuard::~InterruptGuard() {
  begun_file = nullptr;
  for (std::size_t k = 0; k < signals.size(); ++k) sigaction(signals[k], &before_[k], nullptr);
}

void InterruptGuard::remove_if_empty(const std::string& file) {
  kept_file = file;
  begun_file = kept_file.c_str();
}

void InterruptGuard::note_from_now_on(const std::string& text) {
  kept_text = "\n" + text + "\n";
  if (!text.empty()) late_text = kept_text.c_str();
  noted_only = true;
}

bool InterruptGuard::requested() const noexcept {
  return signalled;
}

}  // namespace palpate
