// Exchange of the latest value between two threads, neither of which waits.
#pragma once

#include <atomic>

namespace palpate {

/// The latest value published by one thread for one other thread. Three slots: one is being written, one is
/// being read, and the third is exchanged with either. No call waits.
template <class T>
class Latest {
 public:
  explicit Latest(const T& value) : slots_{value, value, value} {}

  /// Slot to fill before `publish`; it holds an old value.
  [[nodiscard]] T& next() noexcept { return slots_[next_]; }
  void publish() noexcept { next_ = between_.exchange(next_ | unread, std::memory_order_acq_rel) & ~unread; }

  /// The value published last; unchanged until the next call.
  [[nodiscard]] const T& read() noexcept {
    if ((between_.load(std::memory_order_relaxed) & unread) != 0)
      read_ = between_.exchange(read_, std::memory_order_acq_rel) & ~unread;
    return slots_[read_];
  }

 private:
  static constexpr unsigned unread = 4;

  T slots_[3];
  unsigned next_ = 0;
  std::atomic<unsigned> between_ = 1;
  unsigned read_ = 2;
};

}  // namespace palpate
