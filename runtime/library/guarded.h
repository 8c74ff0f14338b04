// What a pointer of palpate.h leads to: it stands between the threads that use it and the one that ends it.
#pragma once

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <thread>

namespace palpate {

/// Whether a thread is the only one of its kind in a Guarded, or one of any number.
enum class Use : std::uint32_t { alone = 1U << 30U, shared = 1 };

/// Keeps a T until it is ended and the last thread is out of it. The guard itself (some 32 bytes) stays for
/// the whole process, so that a pointer to one that has ended is known as such.
template <typename T>
class Guarded {
 public:
  explicit Guarded(std::unique_ptr<T> value) : value_(value.release()), next_(all_.load()) {
    while (!all_.compare_exchange_weak(next_, this)) {
    }
  }
  Guarded(const Guarded&) = delete;
  Guarded& operator=(const Guarded&) = delete;

  /// Null once it is ended, or where another thread is the only one already; else `leave` follows. Real-time
  /// safe.
  T* enter(Use use) noexcept {
    const auto which = static_cast<std::uint32_t>(use);
    const std::uint32_t before = use == Use::alone ? users_.fetch_or(which, std::memory_order_acquire)
                                                   : users_.fetch_add(which, std::memory_order_acquire);
    if (use == Use::alone && (before & which) != 0) return nullptr;
    if ((before & ended) == 0) return value_.load(std::memory_order_relaxed);
    leave(use);
    return nullptr;
  }

  /// Real-time safe unless it is ended meanwhile.
  void leave(Use use) noexcept {
    const auto which = static_cast<std::uint32_t>(use);
    if (users_.fetch_sub(which, std::memory_order_acq_rel) - which == ended)
      delete value_.exchange(nullptr);  // NOLINT(cppcoreguidelines-owning-memory): it is this one's
  }

  /// Ends it, the first time: waits for the threads that are in it. Where one does not come out for seconds
  /// (it is this one, in a signal handler), the last one out ends it. In a process that was forked since,
  /// which has none of its threads, it stays.
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

  std::atomic<std::uint32_t> users_ = 0;  // their number, and the bits `ended` and Use::alone
  std::atomic<T*> value_;
  Guarded* next_;
  const pid_t process_ = ::getpid();
  inline static std::atomic<Guarded*> all_ = nullptr;  // what no pointer leads to is taken for a leak
};

/// A thread in a Guarded, for as long as this lives. Holds null where there is none or the thread may not.
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

}  // namespace palpate
