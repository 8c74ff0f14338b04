// Guard of an object of palpate.h, shared by the threads that use it and the one that ends it.
#pragma once

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <thread>

namespace palpate {

/// Access of a thread to a Guarded: exclusive among threads of its kind, or shared.
enum class Use : std::uint32_t { alone = 1U << 30U, shared = 1 };

/// Keeps a T until it is ended and the last thread has left it. The guard itself (about 32 bytes) lives as
/// long as the process, so that a pointer to an ended object is recognised.
template <typename T>
class Guarded {
 public:
  explicit Guarded(std::unique_ptr<T> value) : value_(value.release()), next_(all.load()) {
    while (!all.compare_exchange_weak(next_, this)) {
    }
  }
  Guarded(const Guarded&) = delete;
  Guarded& operator=(const Guarded&) = delete;

  /// Returns the object; null if it has ended, or another thread already has exclusive access. Unless null,
  /// `leave` must follow. Real-time safe.
  T* enter(Use use) noexcept {
    const auto which = static_cast<std::uint32_t>(use);
    const std::uint32_t before = use == Use::alone ? users_.fetch_or(which, std::memory_order_acquire)
                                                   : users_.fetch_add(which, std::memory_order_acquire);
    if (use == Use::alone && (before & which) != 0) return nullptr;
    if ((before & ended) == 0) return value_.load(std::memory_order_relaxed);
    leave(use);
    return nullptr;
  }

  /// Leaves the object. Real-time safe unless it is ended meanwhile.
  void leave(Use use) noexcept {
    const auto which = static_cast<std::uint32_t>(use);
    if (users_.fetch_sub(which, std::memory_order_acq_rel) - which == ended)
      delete value_.exchange(nullptr);  // NOLINT(cppcoreguidelines-owning-memory): owned by this
  }

  /// Ends the object, once: waits for the threads inside. If one does not leave for seconds (it is this
  /// thread, in a signal handler), the last thread to leave ends it. In a forked child, which has none of
  /// those threads, it is kept.
  void end() noexcept {
    if (::getpid() != process_) return;
    users_.fetch_add(1);
    const bool was_ended = (users_.fetch_or(ended) & ended) != 0;
    for (int k = 0; !was_ended && users_ != (ended | 1U) && k < most_pauses; ++k)
      std::this_thread::sleep_for(pause);
    leave(Use::shared);
  }

 private:
  static constexpr std::uint32_t ended = 1U << 31U;
  static constexpr auto pause = std::chrono::microseconds(100);
  static constexpr int most_pauses = 50'000;

  std::atomic<std::uint32_t> users_ = 0;  // number of threads inside, and the bits `ended` and Use::alone
  std::atomic<T*> value_;
  Guarded* next_;
  const pid_t process_ = ::getpid();
  inline static std::atomic<Guarded*> all = nullptr;  // keeps all guards reachable for leak checkers
};

/// Access of a thread to a Guarded, for the lifetime of this. Holds null if access is refused.
template <typename T>
class Inside {
 public:
  Inside(Guarded<T>* guarded, Use use) noexcept
      : guarded_(guarded), use_(use), value_(guarded != nullptr ? guarded->enter(use) : nullptr) {}
  ~Inside() {
    if (value_ != nullptr) guarded_->leave(use_);
  }
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;

  explicit operator bool() const noexcept { return value_ != nullptr; }
  T* operator->() const noexcept { return value_; }
  T& operator*() const noexcept { return *value_; }

 private:
  Guarded<T>* guarded_;
  Use use_;
  T* value_;
};

/// As one of the threads that only look: what it guards is not changed.
template <typename T>
Inside<T> look(const Guarded<T>* guarded) noexcept {
  return {const_cast<Guarded<T>*>(guarded), Use::shared};  // NOLINT(cppcoreguidelines-pro-type-const-cast)
}

}  // namespace palpate
