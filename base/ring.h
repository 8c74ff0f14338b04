// A queue between two threads, neither of which waits.
#pragma once

#include <atomic>
#include <cstddef>
#include <utility>
#include <vector>

namespace palpate {

/// A bounded queue with one pushing and one popping thread. Neither call waits, locks or allocates.
template <class T>
class Ring {
 public:
  explicit Ring(std::size_t capacity) : slots_(capacity) {}

  /// Returns false, with `value` unchanged, if the queue is full.
  bool push(T& value) noexcept {
    const std::size_t pushed = pushed_.load(std::memory_order_relaxed);
    if (pushed - popped_.load(std::memory_order_acquire) == slots_.size()) return false;
    slots_[pushed % slots_.size()] = std::move(value);
    pushed_.store(pushed + 1, std::memory_order_release);
    return true;
  }

  /// Returns false if the queue is empty.
  bool pop(T& value) noexcept {
    const std::size_t popped = popped_.load(std::memory_order_relaxed);
    if (popped == pushed_.load(std::memory_order_acquire)) return false;
    value = std::move(slots_[popped % slots_.size()]);
    popped_.store(popped + 1, std::memory_order_release);
    return true;
  }

 private:
  std::vector<T> slots_;
  std::atomic<std::size_t> pushed_ = 0;
  std::atomic<std::size_t> popped_ = 0;
};

}  // namespace palpate
