// History of ticks, for pages that read them late.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "runtime/loop/monitor.h"

namespace palpate {

/// Ticks in order of arrival; the oldest are dropped. Each has an index, counted from the very first.
class TickHistory {
 public:
  /// Appends ticks that are `stride` apart. At most the last `most` are kept.
  void append(std::span<const TickNote> ticks, std::int64_t stride, std::size_t most) {
    for (const TickNote& tick : ticks) samples_.push_back({tick, stride});
    while (samples_.size() > most) forget_first();
  }
  void clear() {
    while (!samples_.empty()) forget_first();
  }

  [[nodiscard]] std::int64_t end() const noexcept { return first_ + std::ssize(samples_); }
  /// True if a stored tick has index `place` or a later one.
  [[nodiscard]] bool has_from(std::int64_t place) const noexcept {
    return !samples_.empty() && place < end();
  }

  /// Consecutive ticks without a gap.
  struct Run {
    std::vector<TickNote> ticks;
    std::int64_t stride = 1;
    std::int64_t end = 0;  ///< index after the last
  };
  /// Returns the run from index `place` on, or from the first stored one; empty at the end.
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
  std::int64_t first_ = 0;  // index of the oldest
};

}  // namespace palpate
