#include "runtime/loop/best_effort.h"

#include <algorithm>
#include <cmath>

namespace palpate {

void DecadeHistogram::add(double value) noexcept {
  const double place = value > 0.0 ? (std::log10(value) - least_decade) * per_decade : 0.0;
  const auto last = static_cast<double>(classes_.size() - 1);
  ++classes_[static_cast<std::size_t>(std::clamp(std::floor(place), 0.0, last))];
  ++total_;
}

void DecadeHistogram::add(const DecadeHistogram& other) noexcept {
  for (std::size_t k = 0; k < classes_.size(); ++k) classes_[k] += other.classes_[k];
  total_ += other.total_;
}

double DecadeHistogram::median() const noexcept {
  std::int64_t before = 0;
  for (std::size_t k = 0; k < classes_.size(); ++k) {
    before += classes_[k];
    if (2 * before < total_ || before == 0) continue;
    return k == 0 ? 0.0 : std::pow(10.0, least_decade + static_cast<double>(k + 1) / per_decade);
  }
  return 0.0;
}

void BestEffort::add(StepStatus status, double force, double force_error, std::int64_t left_out,
                     double time) noexcept {
  if (!is_best_effort(status, left_out, force_error)) return;
  ++ticks;
  if (has(status, StepStatus::not_converged)) ++not_converged_ticks;
  if (has(status, StepStatus::unbalanced)) ++unbalanced_ticks;
  if (left_out > 0) ++left_out_ticks;
  if (has(status, StepStatus::late_motion)) {
    ++late_ticks;
    largest_late_error = std::max(largest_late_error, force_error);
  }
  most_left_out = std::max(most_left_out, left_out);
  const double share = force_error > 0.0 ? force_error / std::max(force, force_error) : 0.0;
  largest_share = std::max(largest_share, share);
  errors.add(force_error);
  shares.add(share);
  if (force_error <= largest_error) return;
  largest_error = force_error;
  largest_error_time = time;
}

void BestEffort::add(const BestEffort& later, double time_before) noexcept {
  if (later.largest_error > largest_error) {
    largest_error = later.largest_error;
    largest_error_time = time_before + later.largest_error_time;
  }
  ticks += later.ticks;
  not_converged_ticks += later.not_converged_ticks;
  unbalanced_ticks += later.unbalanced_ticks;
  left_out_ticks += later.left_out_ticks;
  most_left_out = std::max(most_left_out, later.most_left_out);
  largest_share = std::max(largest_share, later.largest_share);
  errors.add(later.errors);
  shares.add(later.shares);
}

}  // namespace palpate
