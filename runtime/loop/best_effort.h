// Ticks whose force is a best effort, and by how much.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "runtime/tick/status.h"

namespace palpate {

/// Counts positive numbers in classes 40 a decade wide from 1e-15 to 1e9: medians to 6 %. Fixed memory.
class DecadeHistogram {
 public:
  void add(double value) noexcept;
  void add(const DecadeHistogram& other) noexcept;
  /// About the middle one, at the upper end of its class; 0 when empty.
  [[nodiscard]] double median() const noexcept;

 private:
  static constexpr int per_decade = 40;
  static constexpr int least_decade = -15;
  static constexpr int decades = 24;
  std::array<std::int64_t, std::size_t{decades} * per_decade> classes_{};
  std::int64_t total_ = 0;
};

/// Whether the force of a tick is a best effort: the solver was cut short, contact points that the tool
/// presses on found no room, or a body that gives way with time stood still.
[[nodiscard]] constexpr bool is_best_effort(StepStatus status, std::int64_t left_out,
                                            double force_error) noexcept {
  return has(status, StepStatus::not_converged) || left_out > 0 || force_error > 0.0;
}

/// What is known of such ticks of a run.
struct BestEffort {
  /// Takes in a tick, which is one or not: the force that is felt and how far it may be off [N].
  void add(StepStatus status, double force, double force_error, std::int64_t left_out, double time) noexcept;

  /// Takes in those of a run that began `time_before` [s] after this one.
  void add(const BestEffort& later, double time_before) noexcept;

  [[nodiscard]] double median_error() const noexcept { return std::min(errors.median(), largest_error); }
  [[nodiscard]] double median_share() const noexcept { return std::min(shares.median(), largest_share); }

  std::int64_t ticks = 0;
  std::int64_t not_converged_ticks = 0;  ///< of them
  std::int64_t left_out_ticks = 0;       ///< of them
  std::int64_t late_ticks = 0;           ///< of them, the body stood still
  double largest_late_error = 0.0;       ///< in these [N]
  std::int64_t most_left_out = 0;        ///< contact points in one tick
  double largest_error = 0.0;            ///< [N]
  double largest_error_time = 0.0;       ///< [s]
  double largest_share = 0.0;            ///< of error in force, 1 where it is more
  DecadeHistogram errors;                ///< [N]
  DecadeHistogram shares;                ///< of error in force
};

}  // namespace palpate
