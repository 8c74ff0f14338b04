// Percentiles of durations without keeping them all.
#pragma once

#include <cstdint>
#include <vector>

namespace palpate {

/// Counts durations in steps of 1 ns up to 1 ms; longer ones only as "longer". Fixed memory, taken at
/// construction.
class TimeHistogram {
 public:
  TimeHistogram();

  void add(std::int64_t nanoseconds) noexcept;

  /// The smallest duration [ns] that at least the fraction 0..1 of all does not exceed (the worst when it is
  /// over 1 ms); 0 when empty.
  [[nodiscard]] std::int64_t percentile(double fraction) const noexcept;

  [[nodiscard]] std::int64_t worst() const noexcept { return worst_; }  ///< [ns]

 private:
  std::vector<std::uint32_t> counts_;
  std::int64_t total_ = 0;
  std::int64_t worst_ = 0;
};

}  // namespace palpate
