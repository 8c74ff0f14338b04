#include "statics/balance.h"

#include <algorithm>
#include <cmath>

#include "statics/live_forces.h"
#include "statics/tangent_solver.h"

namespace palpate {
namespace {

/// Newton steps for one body.
class Balance {
 public:
  Balance(const LiveBody& body, const Eigen::VectorXd& load, std::span<const Mat3> plastic)
      : body_(body), load_(load), plastic_(plastic), solver_({}), K_(body.pattern().zero()) {
    double volume = 0.0, mu = 0.0;
    for (Index point = 0; point < body.all_points(); ++point) {
      volume += body.weight(point);
      mu = std::max(mu, body.constants(point / body.points()).mu);
    }
    stiffness_ = mu * std::cbrt(volume * volume);
  }

  /// Energy of the body under its loads [J]; fills the residual forces on free dofs.
  double look(const Eigen::VectorXd& x, Eigen::VectorXd& left, Index& inverted) {
    const ForceSums sums = internal_forces(body_, x, plastic_, forces_);
    inverted = sums.inverted;
    largest_ = std::max(largest_, forces_.norm());
    left.resize(body_.free_dofs());
    for (Index k = 0; k < body_.free_dofs(); ++k)
      left[k] = forces_[body_.dof_of_free()[k]] + load_[body_.dof_of_free()[k]];
    return sums.energy - load_.dot(x - body_.rest());
  }

  bool direction(const Eigen::VectorXd& x, const Eigen::VectorXd& left, Eigen::VectorXd& step) {
    for (const TangentKind kind : {TangentKind::exact, TangentKind::positive}) {
      assemble_tangent(body_, x, plastic_, kind, K_);
      if (kind == TangentKind::positive) {  // the clamped tangent may be singular
        for (const Index place : body_.pattern().diagonal()) K_.valuePtr()[place] *= 1.0 + 1e-8;
      }
      if (solver_.set(K_) && solver_.solve(left, step)) return true;
    }
    return false;
  }

  /// Norm of the residual forces, relative to the largest norm of forces so far; 0 if it is rounding.
  [[nodiscard]] double share_of(const Eigen::VectorXd& left) const noexcept {
    const double rounding = 1e-13 * stiffness_ * std::sqrt(static_cast<double>(left.size()));
    return left.norm() > rounding ? left.norm() / std::max(largest_, load_.norm()) : 0.0;
  }

 private:
  const LiveBody& body_;
  const Eigen::VectorXd& load_;
  std::span<const Mat3> plastic_;
  TangentSolver solver_;
  LiveMatrix K_;
  Eigen::VectorXd forces_;
  double largest_ = 0.0;
  double stiffness_;  // shear modulus times an area as large as the body [N]
};

}  // namespace

BalanceReport find_balance(const LiveBody& body, const Eigen::VectorXd& load, std::span<const Mat3> plastic,
                           Eigen::VectorXd& x, const BalanceOptions& options) {
  Balance newton(body, load, plastic);
  BalanceReport report;
  Eigen::VectorXd left, step, tried, left_there;
  double energy = newton.look(x, left, report.inverted);
  for (; report.steps < options.most_steps; ++report.steps) {
    report.residual = newton.share_of(left);
    report.converged = report.residual <= options.tolerance;
    if (report.converged || !newton.direction(x, left, step)) break;
    const double slope = left.dot(step), before = left.norm();
    double share = 1.0;
    bool is_lower = false;
    for (int k = 0; k < 40 && !is_lower; ++k, share *= is_lower ? 1.0 : 0.5) {
      tried = x;
      for (Index free = 0; free < body.free_dofs(); ++free)
        tried[body.dof_of_free()[free]] += share * step[free];
      const double there = newton.look(tried, left_there, report.inverted);
      // Near the end rounding hides the energy, and the forces decide.
      is_lower = there <= energy - 1e-4 * share * slope || left_there.norm() < 0.5 * before;
      if (is_lower) energy = there;
    }
    if (!is_lower) break;
    x = tried;
    left = left_there;
  }
  return report;
}

}  // namespace palpate
