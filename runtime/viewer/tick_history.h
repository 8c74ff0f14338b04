// The last ticks, for pages that may take them late.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "runtime/loop/monitor.h"

namespace palpate {

/// Ticks in the order in which they came, the oldest forgotten. Each has a place, counted from the very
/// first.
class TickHistory {
 public:
  /// `ticks` are `stride` apart. Of all, the last `most` are kept.
  void append(std::span<const TickNote> ticks, std::int64_t stride, std::size_t most) {
    for (const TickNote& tick : ticks) samples_.push_back({tick, stride});
    while (samples_.size() > most) forget_first();
  }
  void clear() {
    while (!samples_.empty()) forget_first();
  }

  [[nodiscard]] std::int64_t end() const noexcept { return first_ + std::ssize(samples_); }
  /// Whether any that is kept is at a place or later.
  [[nodiscard]] bool has_from(std::int64_t place) const noexcept {
    return !samples_.empty() && place < end();
  }

  /// Ticks without a gap.
  struct Run {
    std::vector<TickNote> ticks;
    std::int64_t stride = 1;
    std::int64_t end = 0;  ///< place after the last
  };
  /// Those from a place on, or from the first that is kept; none at the end.
  [[nodiscard]] Run run_from(std::int64_t place) const {
    Run run;
    run.end = std::max(place, first_);
    for (; run.end < end(); ++run.end) {
      const Sample& sample = samples_[static_cast<std::size_t>(run.end - first_)];
      if (run.ticks.empty()) run.stride = sample.stride;
      const bool follows = run.ticks.empty() || (sample.stride == run.stride &&
                                                 sample.tick.number == run.ticks.back().number + run.stride);
      if (!follows) break;
      run.ticks.push_back(sample.tick);
    }
    return run;
  }

 private:
  struct Sample {
    TickNote tick;
    std::int64_t stride;
  };

  void forget_first() {
    samples_.pop_front();
    ++first_;
  }

  std::deque<Sample> samples_;
  std::int64_t first_ = 0;  // place of the oldest
};

}  // namespace palpate
