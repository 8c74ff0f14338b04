#include "runtime/core/solve/active_set.h"

#include <algorithm>
#include <cmath>

#include "matrices/packed.h"
#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

constexpr double gap_tolerance = 1e-11;  // rounding error, relative to the largest entry of b

}  // namespace

ActiveSet::ActiveSet(Index max_rows)
    : factor_(1, max_rows),
      active_(max_rows),
      state_(max_rows),
      signed_(max_rows),
      z_(3 * static_cast<std::size_t>(max_rows)),
      entries_(static_cast<std::size_t>(max_rows) + 1),
      lower_(packed_size(max_rows)) {}

/// Adds the first `count` rows of active_ to the factor together; false if they are linearly dependent.
bool ActiveSet::activate_all(const ContactProblem& problem, Index count) noexcept {
  double* to = lower_.data();
  for (Index j = 0; j < count; ++j) {
    const double* row = problem.row(active_[j]);
    for (Index i = j; i < count; ++i) *to++ = row[active_[i]];
  }
  const std::span<const double> lower(lower_.data(), to);
  return factor_.assign(count, lower) == CapacitanceStatus::ok;
}

bool ActiveSet::activate(const ContactProblem& problem, Index row) noexcept {
  const Index count = factor_.nodes();
  for (Index k = 0; k < count; ++k) entries_[k] = problem.w(row, active_[k]);
  entries_[count] = problem.w(row, row);
  const bool added =
      factor_.add({entries_.data(), static_cast<std::size_t>(count) + 1}) == CapacitanceStatus::ok;
  if (added) active_[count] = row;
  state_[row] = added ? Row::active : Row::dependent;
  return added;
}

void ActiveSet::deactivate(Index position) noexcept {
  const auto gap = active_.begin() + position;
  state_[*gap] = Row::inactive;
  std::copy(gap + 1, active_.begin() + factor_.nodes(), gap);
  factor_.remove(position);
}

/// Computes z = -C^-1 b on the active rows.
void ActiveSet::solve_active(std::span<const double> b) noexcept {
  const auto count = static_cast<std::size_t>(factor_.nodes());
  for (std::size_t k = 0; k < count; ++k) z_[k] = -b[active_[k]];
  factor_.solve({z_.data(), count});
}

/// Moves lambda towards z until the first normal force becomes zero, and removes that row. True if z was
/// reached.
bool ActiveSet::step_towards_solution(ContactProblem& problem) noexcept {
  double step = 1.0;
  Index blocking = -1;
  for (Index k = 0; k < factor_.nodes(); ++k) {
    const auto row = static_cast<std::size_t>(active_[k]);
    const double z = z_[k];
    if (signed_[row] != 0 || z >= 0.0) continue;
    const double to_zero = problem.lambda[row] / (problem.lambda[row] - z);
    if (blocking >= 0 && to_zero >= step) continue;
    step = to_zero;
    blocking = k;
  }
  for (Index k = 0; k < factor_.nodes(); ++k) {
    double& lambda = problem.lambda[active_[k]];
    lambda += step * (z_[k] - lambda);
    if (signed_[active_[k]] == 0) lambda = std::max(lambda, 0.0);
  }
  if (blocking < 0) return true;
  problem.lambda[active_[blocking]] = 0.0;
  deactivate(blocking);
  return false;
}

/// Inactive row with the most negative gap beyond rounding; -1 if there is none.
Index ActiveSet::most_violated(const ContactProblem& problem) const noexcept {
  double largest = 0.0;
  for (Index i = 0; i < problem.rows; ++i) largest = std::max(largest, std::abs(problem.b[i]));
  double worst = -gap_tolerance * largest;
  Index found = -1;
  for (Index i = 0; i < problem.rows; ++i) {
    if (state_[i] != Row::inactive) continue;
    const double gap = problem.b[i] + dot(problem.row(i), problem.lambda.data(), problem.rows);
    if (gap < worst) {
      worst = gap;
      found = i;
    }
  }
  return found;
}

/// Activates the rows that carry force in the guess, except linearly dependent ones.
void ActiveSet::begin(ContactProblem& problem) noexcept {
  std::fill_n(state_.begin(), problem.rows, Row::inactive);
  for (Index k = 0; k < problem.contacts; ++k) {
    std::fill_n(signed_.begin() + problem.first_row(k), problem.rows_of(k), problem.held[k]);
  }
  Index count = 0;
  for (Index i = 0; i < problem.rows; ++i) {
    const auto row = static_cast<std::size_t>(i);
    if (signed_[row] == 0) problem.lambda[row] = std::max(problem.lambda[row], 0.0);
    if (signed_[row] != 0 || problem.lambda[row] > 0.0) active_[count++] = i;
  }
  if (activate_all(problem, count)) {
    for (Index k = 0; k < count; ++k) state_[active_[k]] = Row::active;
    return;
  }
  for (Index k = 0; k < count; ++k) {  // in place: active_ is never written ahead of where it is read
    const Index row = active_[k];
    if (!activate(problem, row)) problem.lambda[row] = 0.0;
  }
}

bool ActiveSet::solve(ContactProblem& problem) noexcept {
  rounds_ = 0;
  begin(problem);
  const int most_rounds = 3 * problem.rows + 10;
  Index entered = -1;
  while (rounds_ < most_rounds) {
    ++rounds_;
    solve_active(problem.b);
    if (entered >= 0 && z_[factor_.nodes() - 1] <= 0.0) {  // entered because of rounding alone
      deactivate(factor_.nodes() - 1);
      state_[entered] = Row::dependent;
      entered = -1;
      continue;
    }
    entered = -1;
    if (!step_towards_solution(problem)) continue;
    do {
      entered = most_violated(problem);
      if (entered < 0) return true;
    } while (!activate(problem, entered));
  }
  return false;
}

void ActiveSet::derivative(const ContactProblem& problem, int changes, std::span<const double> db,
                           std::span<double> dlambda) noexcept {
  const auto rows = static_cast<std::size_t>(problem.rows);
  const auto count = static_cast<std::size_t>(factor_.nodes());
  std::fill_n(dlambda.begin(), static_cast<std::size_t>(changes) * rows, 0.0);
  for (std::size_t s = 0; s < static_cast<std::size_t>(changes); ++s) {
    for (std::size_t k = 0; k < count; ++k)
      z_[s * count + k] = -db[s * rows + static_cast<std::size_t>(active_[k])];
  }
  factor_.solve({z_.data(), static_cast<std::size_t>(changes) * count}, changes);
  for (std::size_t s = 0; s < static_cast<std::size_t>(changes); ++s) {
    for (std::size_t k = 0; k < count; ++k)
      dlambda[s * rows + static_cast<std::size_t>(active_[k])] = z_[s * count + k];
  }
}

}  // namespace palpate
