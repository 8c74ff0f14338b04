#include "runtime/core/solve/cone_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

double largest_force(const ContactProblem& problem) noexcept {
  double largest = 0.0;
  for (Index i = 0; i < problem.rows; ++i) largest = std::max(largest, std::abs(problem.lambda[i]));
  return largest;
}

/// Tangential force of a contact, with one or two components.
struct Tangential {
  double x = 0.0;
  double y = 0.0;
  [[nodiscard]] double norm() const noexcept { return std::sqrt(x * x + y * y); }
  /// Nearest point in a disc of this radius.
  [[nodiscard]] Tangential within(double radius) const noexcept {
    const double length = norm();
    if (length <= radius) return *this;
    return {x * radius / length, y * radius / length};
  }
};

Tangential tangential(const double* rows, Index count) noexcept {
  return {rows[1], count == 3 ? rows[2] : 0.0};
}

}  // namespace

ConeSolver::ConeSolver(Index max_contacts, Index max_rows)
    : part_(max_contacts, max_rows),
      without_friction_(max_rows),
      stride_((std::ptrdiff_t{max_rows} + 7) / 8 * 8) {
  const auto rows = static_cast<std::size_t>(max_rows);
  motion_.resize(rows);
  weight_.resize(rows);
  mode_.resize(max_contacts);
  direction_.resize(rows);
  share_.resize(max_contacts);
  unknown_.resize(rows);
  J_.resize(rows * static_cast<std::size_t>(stride_));
  pivot_.resize(rows);
  x_.resize(rows);
  best_.resize(rows);
  from_.resize(rows);
  guess_.resize(rows);
  diagonal_.resize(rows);
  b_.resize(rows);
  newton_.resize(rows);
}

/// Computes r = b + W lambda.
void ConeSolver::find_motion(const ContactProblem& problem) noexcept {
  for (Index i = 0; i < problem.rows; ++i) {
    motion_[i] = problem.b[i] + dot(problem.row(i), problem.lambda.data(), problem.rows);
  }
}

/// Changes one force, and the motion with it.
void ConeSolver::change(ContactProblem& problem, Index row, double by) noexcept {
  if (by == 0.0) return;
  problem.lambda[row] += by;
  subtract(problem.row(row), -by, motion_.data(), problem.rows);
}

void ConeSolver::scale_rows(const ContactProblem& problem) noexcept {
  for (Index k = 0; k < problem.contacts; ++k) {
    const Index i = problem.first_row(k);
    const Index count = problem.rows_of(k);
    double tangent = 0.0;
    for (Index j = i + 1; j < i + count; ++j) tangent = std::max(tangent, problem.w(j, j));
    weight_[i] = 1.0 / problem.w(i, i);
    for (Index j = i + 1; j < i + count; ++j) weight_[j] = 1.0 / tangent;
  }
}

double ConeSolver::residual(const ContactProblem& problem) const noexcept {
  double worst = 0.0;
  for (Index k = 0; k < problem.contacts; ++k) {
    const Index first = problem.first_row(k);
    const Index count = problem.rows_of(k);
    const double* lambda = problem.lambda.data() + first;
    const double* r = motion_.data() + first;
    const double* weight = weight_.data() + first;
    const double normal = std::max(0.0, lambda[0] - weight[0] * r[0]);
    worst = std::max(worst, std::abs(lambda[0] - normal));
    if (count == 1) continue;
    const Tangential now = tangential(lambda, count);
    const Tangential moved = tangential(r, count);
    const Tangential to = Tangential{now.x - weight[1] * moved.x, now.y - weight[1] * moved.y}.within(
        problem.friction[k] * normal);
    worst = std::max(worst, Tangential{now.x - to.x, now.y - to.y}.norm());
  }
  return worst;
}

/// Solves each contact in turn, with the forces of the others fixed.
void ConeSolver::sweep(ContactProblem& problem) noexcept {
  for (Index k = 0; k < problem.contacts; ++k) {
    const Index first = problem.first_row(k);
    const Index count = problem.rows_of(k);
    const auto at = static_cast<std::size_t>(first);
    for (int round = 0; round < tuning.cone.local_rounds; ++round) {
      const double normal = std::max(0.0, problem.lambda[at] - weight_[at] * motion_[at]);
      change(problem, first, normal - problem.lambda[at]);
      if (count == 1) break;
      const Tangential now = tangential(problem.lambda.data() + first, count);
      const Tangential moved = tangential(motion_.data() + first, count);
      const Tangential to =
          Tangential{now.x - weight_[at + 1] * moved.x, now.y - weight_[at + 1] * moved.y}.within(
              problem.friction[k] * normal);
      change(problem, first + 1, to.x - now.x);
      if (count == 3) change(problem, first + 2, to.y - now.y);
    }
  }
}

void ConeSolver::choose_modes(const ContactProblem& problem) noexcept {
  unknowns_ = 0;
  for (Index k = 0; k < problem.contacts; ++k) {
    const auto contact = static_cast<std::size_t>(k);
    const Index first = problem.first_row(k);
    const auto at = static_cast<std::size_t>(first);
    const Index count = problem.rows_of(k);
    Mode mode = Mode::stick;
    if (problem.lambda[at] - weight_[at] * motion_[at] <= 0.0) {
      mode = Mode::open;
    } else if (count > 1) {
      const Tangential now = tangential(problem.lambda.data() + first, count);
      const Tangential moved = tangential(motion_.data() + first, count);
      const Tangential z{now.x - weight_[at + 1] * moved.x, now.y - weight_[at + 1] * moved.y};
      const double length = z.norm();
      const double bound = problem.friction[contact] * std::max(0.0, problem.lambda[at]);
      if (length > bound) {
        mode = Mode::slip;
        share_[contact] = bound / length;
        direction_[at + 1] = z.x / length;
        if (count == 3) direction_[at + 2] = z.y / length;
      }
    }
    mode_[contact] = mode;
    if (mode == Mode::open) continue;
    for (Index i = first; i < first + count; ++i) unknown_[unknowns_++] = i;
  }
}

/// Sets up the Jacobian of the equations: rows of W, except for a slipping contact
///   dlambda_t - mu dlambda_n e - s (I - e e^T) (dlambda_t - dr_t / w_t), with s from share_ and e the
///   direction.
void ConeSolver::linearise(const ContactProblem& problem) noexcept {
  const auto gather_row = [&](Index row, double factor, double* out) {
    const double* w = problem.row(row);
    for (Index j = 0; j < unknowns_; ++j) out[j] += factor * w[unknown_[j]];
  };
  Index next = 0;
  for (Index k = 0; k < problem.contacts; ++k) {
    const auto contact = static_cast<std::size_t>(k);
    if (mode_[contact] == Mode::open) continue;
    const Index first = problem.first_row(k);
    const Index count = problem.rows_of(k);
    const Index base = next;
    next += count;
    for (Index i = 0; i < count; ++i) {
      const Index row = first + i;
      double* out = jacobian_row(base + i);
      std::fill_n(out, unknowns_, 0.0);
      if (mode_[contact] != Mode::slip || i == 0) {
        gather_row(row, 1.0, out);
        continue;
      }
      // In metres like the other rows: the equation of forces divided by the weight.
      const double compliance = 1.0 / weight_[row];
      const double e = direction_[row];
      out[base] -= compliance * problem.friction[contact] * e;
      out[base + i] += compliance;
      for (Index j = 1; j < count; ++j) {
        const Index tangent = first + j;
        const double across = (i == j ? 1.0 : 0.0) - e * direction_[tangent];
        out[base + j] -= compliance * share_[contact] * across;
        gather_row(tangent, share_[contact] * across, out);
      }
    }
  }
}

/// Factorises P J = L U with row pivoting.
bool ConeSolver::factor_jacobian() noexcept {
  for (Index k = 0; k < unknowns_; ++k) {
    Index best = k;
    for (Index i = k + 1; i < unknowns_; ++i) {
      if (std::abs(jacobian_row(i)[k]) > std::abs(jacobian_row(best)[k])) best = i;
    }
    pivot_[k] = best;
    double* top = jacobian_row(k);
    if (best != k) std::swap_ranges(top, top + unknowns_, jacobian_row(best));
    if (!(std::abs(top[k]) > std::numeric_limits<double>::min())) return false;
    const double inverse = 1.0 / top[k];
    for (Index i = k + 1; i < unknowns_; ++i) {
      double* row = jacobian_row(i);
      const double factor = row[k] * inverse;
      row[k] = factor;
      if (factor != 0.0) subtract(top + k + 1, factor, row + k + 1, unknowns_ - k - 1);
    }
  }
  return true;
}

/// Solves x = J^-1 x in place.
void ConeSolver::solve_jacobian() noexcept {
  for (Index k = 0; k < unknowns_; ++k) std::swap(x_[k], x_[pivot_[k]]);
  for (Index i = 0; i < unknowns_; ++i) x_[i] -= dot(jacobian_row(i), x_.data(), i);
  for (Index i = unknowns_; i-- > 0;) {
    const double* row = jacobian_row(i);
    double& x = x_[i];
    x = (x - dot(row + i + 1, x_.data() + i + 1, unknowns_ - i - 1)) / row[i];
  }
}

/// Performs one Newton step from lambda; false, with nothing changed, if J is singular.
bool ConeSolver::newton_step(ContactProblem& problem) noexcept {
  choose_modes(problem);
  for (Index k = 0; k < problem.contacts; ++k) {
    if (mode_[k] != Mode::open) continue;
    for (Index i = problem.first_row(k); i < problem.first_row(k + 1); ++i)
      change(problem, i, -problem.lambda[i]);
  }
  linearise(problem);
  if (!factor_jacobian()) return false;

  Index next = 0;
  for (Index k = 0; k < problem.contacts; ++k) {
    const auto contact = static_cast<std::size_t>(k);
    if (mode_[contact] == Mode::open) continue;
    const auto first = static_cast<std::size_t>(problem.first_row(k));
    for (Index i = 0; i < problem.rows_of(k); ++i) {
      const std::size_t row = first + static_cast<std::size_t>(i);
      double value = motion_[row];
      if (mode_[contact] == Mode::slip && i > 0) {
        const double bound = problem.friction[contact] * std::max(0.0, problem.lambda[first]);
        value = (problem.lambda[row] - bound * direction_[row]) / weight_[row];
      }
      x_[next++] = -value;
    }
  }
  solve_jacobian();
  for (Index j = 0; j < unknowns_; ++j) problem.lambda[unknown_[j]] += x_[j];
  find_motion(problem);
  return true;
}

/// Takes the longest of several fractions of the Newton step from `from` that reduces the residual enough;
/// false, with nothing changed, if none does.
bool ConeSolver::search_along_step(ContactProblem& problem, double& now) noexcept {
  std::copy_n(problem.lambda.begin(), problem.rows, newton_.begin());
  for (const double share : tuning.cone.step_shares) {
    if (share < 1.0) {
      for (std::size_t i = 0; i < static_cast<std::size_t>(problem.rows); ++i)
        problem.lambda[i] = from_[i] + share * (newton_[i] - from_[i]);
      find_motion(problem);
    }
    const double then = residual(problem);
    if (then > (1.0 - tuning.cone.least_gain * share) * now) continue;
    now = then;
    return true;
  }
  return false;
}

void ConeSolver::start_from(ContactProblem& problem, const std::vector<double>& lambda) noexcept {
  std::copy_n(lambda.begin(), problem.rows, problem.lambda.begin());
  find_motion(problem);
}

/// Newton's method from lambda, at most `rounds` rounds. True if the residual is small enough; otherwise
/// lambda is the best found.
bool ConeSolver::iterate(ContactProblem& problem, int rounds) noexcept {
  scale_rows(problem);
  find_motion(problem);
  double now = residual(problem);
  double best = std::numeric_limits<double>::infinity();
  for (int round = 0; round < rounds && !budget_spent(); ++round) {
    if (now < best) {
      best = now;
      std::copy_n(problem.lambda.begin(), problem.rows, best_.begin());
    }
    std::copy_n(problem.lambda.begin(), problem.rows, from_.begin());
    const bool stepped = newton_step(problem);
    ++rounds_;
    work_ += std::pow(unknowns_, 3) / 3.0 + 2.0 * std::pow(problem.rows, 2);
    if (stepped && is_good_enough(problem, tuning.cone.tolerance)) return true;
    if (stepped && search_along_step(problem, now)) continue;
    // Newton may cycle between sets of closed contacts: do tuning.cone.sweeps from the end of its step,
    // sometimes from its start.
    const bool returns = (round + 1) % tuning.cone.return_stride == 0;
    start_from(problem, stepped && !returns ? newton_ : from_);
    for (int k = 0; k < tuning.cone.sweeps; ++k) sweep(problem);
    work_ += (3.0 * tuning.cone.sweeps + 4.0) * std::pow(problem.rows, 2) * tuning.cone.local_rounds;
    now = residual(problem);
  }
  if (best < now) start_from(problem, best_);
  return false;
}

/// Adds a proximal term that pulls lambda towards its present value, with the weight `share` w_ii.
void ConeSolver::add_springs(ContactProblem& problem, double share) noexcept {
  for (Index i = 0; i < problem.rows; ++i) {
    const auto row = static_cast<std::size_t>(i);
    diagonal_[row] = problem.w(i, i);
    b_[row] = problem.b[row];
    problem.b[row] -= share * diagonal_[row] * problem.lambda[row];
    problem.w(i, i) += share * diagonal_[row];
  }
}

void ConeSolver::remove_springs(ContactProblem& problem) noexcept {
  for (Index i = 0; i < problem.rows; ++i) {
    problem.w(i, i) = diagonal_[i];
    problem.b[i] = b_[i];
  }
}

bool ConeSolver::is_good_enough(const ContactProblem& problem, double share) const noexcept {
  return residual(problem) <= share * largest_force(problem);
}

/// Solves the part, starting from lambda.
bool ConeSolver::solve_part(ContactProblem& problem) noexcept {
  std::copy_n(problem.lambda.begin(), problem.rows, guess_.begin());
  if (iterate(problem, tuning.cone.plain_rounds)) return true;

  start_from(problem, guess_);
  for (double share = tuning.cone.first_share; !budget_spent(); share *= tuning.cone.next_share) {
    add_springs(problem, share);
    iterate(problem, tuning.cone.spring_rounds);
    remove_springs(problem);
    scale_rows(problem);
    find_motion(problem);
    if (is_good_enough(problem, tuning.cone.tolerance)) return true;
  }
  return is_good_enough(problem, tuning.cone.accepted);
}

bool ConeSolver::solve(ContactProblem& problem) noexcept {
  rounds_ = 0;
  work_ = 0.0;
  if (!part_.choose_closed(problem)) {  // the frictionless solution is the guess
    part_.choose_all(problem);
    part_.gather(problem, false);
    without_friction_.solve(part_.problem);
    part_.spread(problem);
    part_.choose_closed(problem);
  }
  for (;;) {
    part_.gather(problem, true);
    const bool solved = solve_part(part_.problem);
    part_.spread(problem);
    if (!part_.take_in_penetrated(problem, tuning.cone.accepted * largest_force(part_.problem)))
      return solved;
    if (budget_spent()) return false;
  }
}

bool ConeSolver::budget_spent() const noexcept {
  return rounds_ >= most_rounds_ || (rounds_ >= tuning.cone.fewest_rounds && work_ >= most_work_);
}

void ConeSolver::derivative(const ContactProblem& problem, std::span<const double> db,
                            std::span<double> dlambda) noexcept {
  std::fill_n(dlambda.begin(), problem.rows, 0.0);
  part_.gather_change(db, b_);
  Index next = 0;
  for (Index k = 0; k < part_.problem.contacts; ++k) {
    const auto contact = static_cast<std::size_t>(k);
    if (mode_[contact] == Mode::open) continue;
    const auto first = static_cast<std::size_t>(part_.problem.first_row(k));
    const Index count = part_.problem.rows_of(k);
    for (Index i = 0; i < count; ++i) {
      const std::size_t row = first + static_cast<std::size_t>(i);
      double value = b_[row];
      if (mode_[contact] == Mode::slip && i > 0) {
        value = 0.0;
        for (Index j = 1; j < count; ++j) {
          const std::size_t tangent = first + static_cast<std::size_t>(j);
          const double across = (i == j ? 1.0 : 0.0) - direction_[row] * direction_[tangent];
          value += share_[contact] * across * b_[tangent];
        }
      }
      x_[next++] = -value;
    }
  }
  solve_jacobian();
  std::fill_n(guess_.begin(), part_.problem.rows, 0.0);
  for (Index j = 0; j < unknowns_; ++j) guess_[unknown_[j]] = x_[j];
  part_.spread_change(guess_, dlambda);
}

}  // namespace palpate
