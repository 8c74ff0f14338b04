// Percentiles of durations without keeping them all.
#pragma once

#include <cstdint>
#include <vector>

namespace palpate {

/// Counts durations in steps of 1 ns up to 1 ms, and of 1 us from there up to 1 s; longer ones only as
/// "longer". Fixed memory, taken at construction.
class TimeHistogram {
 public:
  TimeHistogram();

  void add(std::int64_t nanoseconds) noexcept;  ///< negative ones count as 0
  void clear() noexcept;

  /// The smallest duration [ns] that at least the fraction 0..1 of all does not exceed, rounded up to the
  /// step (the worst when it is over 1 s); 0 when empty.
  [[nodiscard]] std::int64_t percentile(double fraction) const noexcept;

  /// How many lie in [from, to) [ns], by steps.
  [[nodiscard]] std::int64_t total_between(std::int64_t from, std::int64_t to) const noexcept;
  [[nodiscard]] std::int64_t total() const noexcept { return total_; }
  [[nodiscard]] std::int64_t worst() const noexcept { return worst_; }  ///< [ns]

 private:
  std::vector<std::int64_t> fine_;    // of 1 ns
  std::vector<std::int64_t> coarse_;  // of 1 us, from 1 ms on
  std::int64_t longer_ = 0;
  std::int64_t total_ = 0;
  std::int64_t worst_ = 0;
};

}  // namespace palpate
