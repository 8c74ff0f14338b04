// Percentiles of durations without keeping them all.
#pragma once

#include <cstdint>
#include <vector>

namespace palpate {

/// Counts durations in steps of 1 ns below 1 us and of at most 1/500 of them from there up to 1 s; longer
/// ones only as "longer". Between 500 ns and 500 ns times a power of 2 there are whole steps. Fixed memory of
/// 88 kB, taken at construction.
class TimeHistogram {
 public:
  TimeHistogram();

  void add(std::int64_t nanoseconds) noexcept;  ///< negative ones count as 0
  void add(const TimeHistogram& other) noexcept;
  void clear() noexcept;

  /// The smallest duration [ns] that at least the fraction 0..1 of all does not exceed, rounded up to the
  /// step (the worst when it is over 1 s); 0 when empty.
  [[nodiscard]] std::int64_t percentile(double fraction) const noexcept;

  /// How many lie in [from, to) [ns], by steps.
  [[nodiscard]] std::int64_t total_between(std::int64_t from, std::int64_t to) const noexcept;
  [[nodiscard]] std::int64_t total() const noexcept { return total_; }
  [[nodiscard]] std::int64_t worst() const noexcept { return worst_; }  ///< [ns]

 private:
  std::vector<std::int64_t> counts_;  // by steps
  std::int64_t longer_ = 0;
  std::int64_t total_ = 0;
  std::int64_t worst_ = 0;
};

}  // namespace palpate
