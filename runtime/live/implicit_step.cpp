#include "runtime/live/implicit_step.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "statics/live_forces.h"

namespace palpate {
namespace {

constexpr int most_halvings = 20;  // halvings of a Newton step

}  // namespace

ImplicitStep::ImplicitStep(const LiveBody& body, const ImplicitOptions& options, std::vector<Wall> walls)
    : body_(body),
      options_(options),
      solver_(options.solver),
      contacts_(body, std::move(walls)),
      A_(body.pattern().zero()),
      K_(A_),
      damping_(A_) {}

StepFactors step_factors(Integrator integrator, double h) {
  const bool half = integrator == Integrator::midpoint;  // implicit Euler to the midpoint
  const double t = 1.0 / (half ? 0.5 * h : h);
  return {.s = t * t, .t = t, .ahead = half ? 2.0 : 1.0};
}

/// Computes the residual forces on free dofs and returns the potential of which they are the gradient [J].
double ImplicitStep::look(const Eigen::VectorXd& x, const LiveState& state, const Eigen::VectorXd& push,
                          const StepFactors& step) {
  const Eigen::VectorXd& M = body_.mass();
  const ForceSums sums = internal_forces(body_, x, state.plastic, forces_);
  double potential = sums.energy;
  inverted_ = std::max(inverted_, sums.inverted);
  const Eigen::VectorXd acceleration = step.s * (x - state.x) - step.t * state.v;
  inertia_ = M.cwiseProduct(acceleration);
  potential += 0.5 / step.s * inertia_.dot(acceleration);
  const Eigen::VectorXd velocity = step.t * (x - state.x);
  const Rayleigh& damping = body_.options().damping;
  viscous_ = damping.mass * M.cwiseProduct(velocity);
  potential += 0.5 / step.t * viscous_.dot(velocity);
  wall_forces_.setZero(x.size());
  contacts_.add_forces(wall_forces_);
  potential -= (body_.load() + push + wall_forces_).dot(x - state.x);
  left_.resize(body_.free_dofs());
  for (Index free = 0; free < body_.free_dofs(); ++free) {
    const Index dof = body_.dof_of_free()[free];
    left_[free] =
        forces_[dof] + body_.load()[dof] + push[dof] + wall_forces_[dof] - inertia_[dof] - viscous_[dof];
  }
  if (damping.stiffness > 0.0) {
    Eigen::VectorXd free_velocity(left_.size());
    for (Index free = 0; free < body_.free_dofs(); ++free)
      free_velocity[free] = velocity[body_.dof_of_free()[free]];
    const Eigen::VectorXd resisting = damping_.selfadjointView<Eigen::Lower>() * free_velocity;
    potential += 0.5 / step.t * resisting.dot(free_velocity);
    left_ -= resisting;
  }
  return potential;
}

/// Sets A = s M + t C_d + K. False if it is not positive definite.
bool ImplicitStep::set_matrix(const Eigen::VectorXd& x, const LiveState& state, const StepFactors& step,
                              TangentKind kind) {
  assemble_tangent(body_, x, state.plastic, kind, K_);
  const Rayleigh& damping = body_.options().damping;
  std::copy_n(K_.valuePtr(), K_.nonZeros(), A_.valuePtr());
  if (damping.stiffness > 0.0) {
    for (Eigen::Index k = 0; k < A_.nonZeros(); ++k) A_.valuePtr()[k] += step.t * damping_.valuePtr()[k];
  }
  for (Index free = 0; free < body_.free_dofs(); ++free)
    A_.valuePtr()[body_.pattern().diagonal()[free]] +=
        (step.s + step.t * damping.mass) * body_.mass()[body_.dof_of_free()[free]];
  double sum = 0.0;  // sum for the rounding error of the forces
  for (Index free = 0; free < body_.free_dofs(); ++free) {
    const double force = A_.valuePtr()[body_.pattern().diagonal()[free]] * x[body_.dof_of_free()[free]];
    sum += force * force;
  }
  rounding_ = 4.0 * std::numeric_limits<double>::epsilon() * std::sqrt(sum);
  return solver_.set(A_);
}

double ImplicitStep::share_left() const noexcept {
  const double largest =
      std::max({forces_.norm(), inertia_.norm(), body_.load().norm(), wall_forces_.norm(), viscous_.norm()});
  return left_.norm() > rounding_ ? left_.norm() / largest : 0.0;
}

/// Performs one Newton step, including wall forces. False if it does not reduce the residual.
bool ImplicitStep::newton_step(Eigen::VectorXd& x, const LiveState& state, const Eigen::VectorXd& push,
                               const StepFactors& step, double& potential) {
  if (!set_matrix(x, state, step, TangentKind::positive) || !solver_.solve(left_, change_)) return false;
  const Eigen::VectorXd from = x;
  const double slope = left_.dot(change_), before = left_.norm();
  double share = 1.0;
  for (int k = 0; k < most_halvings; ++k, share *= 0.5) {
    x = from;
    for (Index free = 0; free < body_.free_dofs(); ++free)
      x[body_.dof_of_free()[free]] += share * change_[free];
    if (contacts_.any_walls()) {
      const bool has_new = contacts_.find(Eigen::VectorXd(state.x + step.ahead * (x - state.x)));
      if (has_new || contacts_.count() > 0) {
        contacts_.solve(solver_, step.ahead, x);
        potential = look(x, state, push, step);
        if (std::isfinite(potential)) return true;
        continue;
      }
    }
    const double there = look(x, state, push, step);
    if (there <= potential - 1e-4 * share * slope || left_.norm() < 0.5 * before) {
      potential = there;
      return true;
    }
  }
  return false;
}

/// Position and velocity at the end of the step.
void ImplicitStep::finish(const Eigen::VectorXd& x, const StepFactors& step, LiveState& state) {
  for (Index free = 0; free < body_.free_dofs(); ++free) {
    const Index dof = body_.dof_of_free()[free];
    const double moved = x[dof] - state.x[dof];
    state.v[dof] = step.ahead * step.t * moved - (step.ahead - 1.0) * state.v[dof];
    state.x[dof] += step.ahead * moved;
  }
  if (options_.integrator == Integrator::implicit_euler) return;
  for (const WallContacts::Contact& contact : contacts_.contacts()) {  // walls are inelastic
    if (contact.force == Vec3::Zero()) continue;
    auto v = state.v.segment(Eigen::Index{body_.dimension()} * contact.node, body_.dimension());
    const auto n = contact.normal.head(body_.dimension());
    v -= std::max(n.dot(v), 0.0) * n;
  }
}

ImplicitReport ImplicitStep::advance(LiveState& state, double h, const Eigen::VectorXd& push) {
  const StepFactors step = step_factors(options_.integrator, h);
  contacts_.begin(state.x);
  if (body_.options().damping.stiffness > 0.0) {
    assemble_tangent(body_, state.x, state.plastic, TangentKind::positive, damping_);
    for (Eigen::Index k = 0; k < damping_.nonZeros(); ++k)
      damping_.valuePtr()[k] *= body_.options().damping.stiffness;
  }
  inverted_ = 0;
  Eigen::VectorXd x = state.x;
  double potential = look(x, state, push, step);
  for (int newton = 0; newton < options_.most_newton; ++newton) {
    if (!newton_step(x, state, push, step, potential) || share_left() <= options_.tolerance) break;
  }
  // Rounding can hide progress from the line search; then the residual decides. A single linear step is
  // accepted as it is.
  const bool converged =
      share_left() <= 100.0 * options_.tolerance || (options_.most_newton == 1 && x.allFinite());
  finish(x, step, state);
  return {converged, inverted_};
}

}  // namespace palpate
