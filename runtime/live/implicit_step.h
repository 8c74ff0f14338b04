// Implicit time steps of a live body: Newton's method for the balance of forces.
#pragma once

#include <Eigen/Core>

#include "runtime/live/integrator.h"
#include "runtime/live/live_state.h"
#include "runtime/live/wall_contacts.h"
#include "statics/tangent_solver.h"

namespace palpate {

struct ImplicitOptions {
  Integrator integrator = Integrator::implicit_euler;
  TangentSolverOptions solver{};
  double tolerance = 1e-8;  ///< residual force, relative to the largest force during the step
  int most_newton = 20;     ///< Newton steps; with 1 each time step is linear, as in real-time solvers
};

struct ImplicitReport {
  bool converged = false;
  Index inverted = 0;  ///< largest number of inverted quadrature points during the step
};

/// Step of an implicit integrator: at the positions x that it solves for, velocity is t (x - x0)
/// and acceleration s (x - x0) - t v0.
struct StepFactors {
  double s = 0.0;      ///< [1/s^2]
  double t = 0.0;      ///< [1/s]
  double ahead = 1.0;  ///< (x at the end of the step - x0) / (solved x - x0)
};
StepFactors step_factors(Integrator integrator, double h);

/// Steps M x'' + C_d x' = f(x) + load by implicit Euler or the midpoint rule, in walls. C_d = a M + b K with
/// K the positive tangent where the step begins. A is the matrix of Newton's last step, s M + t C_d + K: its
/// inverse says how positions at the step's end follow forces.
class ImplicitStep {
 public:
  ImplicitStep(const LiveBody& body, const ImplicitOptions& options, std::vector<Wall> walls);

  /// Advances the state by h [s] under `push` [d N] in addition to the body's load [N]. After a failure the
  /// state is invalid.
  ImplicitReport advance(LiveState& state, double h, const Eigen::VectorXd& push);

  [[nodiscard]] const TangentSolver& solver() const noexcept { return solver_; }
  [[nodiscard]] const WallContacts& contacts() const noexcept { return contacts_; }

 private:
  double look(const Eigen::VectorXd& x, const LiveState& state, const Eigen::VectorXd& push,
              const StepFactors& step);
  bool set_matrix(const Eigen::VectorXd& x, const LiveState& state, const StepFactors& step,
                  TangentKind kind);
  bool newton_step(Eigen::VectorXd& x, const LiveState& state, const Eigen::VectorXd& push,
                   const StepFactors& step, double& potential);
  [[nodiscard]] double share_left() const noexcept;
  void finish(const Eigen::VectorXd& x, const StepFactors& step, LiveState& state);

  const LiveBody& body_;
  ImplicitOptions options_;
  TangentSolver solver_;
  WallContacts contacts_;
  LiveMatrix A_, K_, damping_;                                // damping_: b K at the beginning of the step
  Eigen::VectorXd forces_, wall_forces_, inertia_, viscous_;  // [d N]
  Index inverted_ = 0;
  double rounding_ = 0.0;          // rounding error of forces [N]
  Eigen::VectorXd left_, change_;  // [n]
};

}  // namespace palpate
