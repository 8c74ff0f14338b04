// Ticks whose force is a best effort, and the size of its error.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "runtime/core/tick/status.h"

namespace palpate {

/// Counts positive numbers from 1e-15 to 1e9 in 40 classes per decade, for medians accurate to 6 %. Fixed
/// memory.
class DecadeHistogram {
 public:
  void add(double value) noexcept;
  void add(const DecadeHistogram& other) noexcept;
  /// Median, at the upper end of its class; 0 if empty.
  [[nodiscard]] double median() const noexcept;

 private:
  static constexpr int per_decade = 40;
  static constexpr int least_decade = -15;
  static constexpr int decades = 24;
  std::array<std::int64_t, std::size_t{decades} * per_decade> classes_{};
  std::int64_t total_ = 0;
};

/// True if the force of a tick is a best effort: the solver was stopped early, contact points pressed by the
/// tool exceeded the capacity, a time-dependent body was not stepped, or its balance not met.
[[nodiscard]] constexpr bool is_best_effort(StepStatus status, std::int64_t left_out,
                                            double force_error) noexcept {
  return has(status, StepStatus::not_converged) || left_out > 0 || force_error > 0.0;
}

/// Statistics of the best-effort ticks of a run.
struct BestEffort {
  /// Adds a tick of any kind: the force on the hand and its possible error [N].
  void add(StepStatus status, double force, double force_error, std::int64_t left_out, double time) noexcept;

  /// Adds the statistics of a later run, which began `time_before` [s] after this one.
  void add(const BestEffort& later, double time_before) noexcept;

  [[nodiscard]] double median_error() const noexcept { return std::min(errors.median(), largest_error); }
  [[nodiscard]] double median_share() const noexcept { return std::min(shares.median(), largest_share); }

  std::int64_t ticks = 0;
  std::int64_t not_converged_ticks = 0;  ///< best-effort ticks without convergence
  std::int64_t unbalanced_ticks = 0;     ///< best-effort ticks in which the balance at depth was not met
  std::int64_t left_out_ticks = 0;       ///< best-effort ticks with contact points left out
  std::int64_t late_ticks = 0;           ///< best-effort ticks in which the body was not stepped
  double largest_late_error = 0.0;       ///< in the late ticks [N]
  std::int64_t most_left_out = 0;        ///< most contact points left out of one tick
  double largest_error = 0.0;            ///< [N]
  double largest_error_time = 0.0;       ///< [s]
  double largest_share = 0.0;            ///< error / force, at most 1
  DecadeHistogram errors;                ///< [N]
  DecadeHistogram shares;                ///< error / force
};

}  // namespace palpate
