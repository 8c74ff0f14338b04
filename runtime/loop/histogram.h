// Percentiles of durations in fixed memory.
#pragma once

#include <cstdint>
#include <vector>

namespace palpate {

inline double microseconds(std::int64_t nanoseconds) noexcept {
  return 1e-3 * static_cast<double>(nanoseconds);
}

/// Counts durations up to 1 s in steps of 1 ns below 1 us, and of at most 1/500 of the duration above; longer
/// ones only as "longer". The boundaries 500 ns times a power of 2 are exact. Fixed memory of 88 kB,
/// allocated at construction.
class TimeHistogram {
 public:
  TimeHistogram();

  void add(std::int64_t nanoseconds) noexcept;  ///< a negative duration counts as 0
  void add(const TimeHistogram& other) noexcept;
  void clear() noexcept;

  /// Smallest duration [ns] not exceeded by at least the fraction 0..1 of all, rounded up to its step (the
  /// worst one if it is over 1 s); 0 if empty.
  [[nodiscard]] std::int64_t percentile(double fraction) const noexcept;

  /// Number of durations in [from, to) [ns], at the resolution of the steps.
  [[nodiscard]] std::int64_t total_between(std::int64_t from, std::int64_t to) const noexcept;
  [[nodiscard]] std::int64_t total() const noexcept { return total_; }
  [[nodiscard]] std::int64_t worst() const noexcept { return worst_; }  ///< [ns]

 private:
  std::vector<std::int64_t> counts_;  // per step
  std::int64_t longer_ = 0;
  std::int64_t total_ = 0;
  std::int64_t worst_ = 0;
};

}  // namespace palpate
