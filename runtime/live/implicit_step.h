// Implicit steps of a live body: Newton's method on the balance at the end of the step.
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
  double tolerance = 1e-8;  ///< forces left, of the largest in the way
  int most_newton = 20;     ///< Newton's steps; with 1 each time step is linear, as real-time solvers have it
};

struct ImplicitReport {
  bool converged = false;
  int newton = 0;         ///< steps of Newton's method
  double residual = 0.0;  ///< as `tolerance` has it
  Index inverted = 0;     ///< most quadrature points on the way
};

/// What an implicit integrator makes of a step: at the positions x that it solves for, velocity is t (x - x0)
/// and acceleration s (x - x0), beside what was before.
struct StepFactors {
  double s = 0.0;      ///< [1/s^2]
  double t = 0.0;      ///< [1/s]
  double ahead = 1.0;  ///< the step's end is as many times as far from its beginning as x is
};
StepFactors step_factors(Integrator integrator, double h);

/// Steps M x'' + C_d x' = f(x) + load by implicit Euler, the midpoint rule or Newmark's method, in walls. C_d
/// = a M + b K with K the positive tangent where the step begins. A is the matrix of Newton's last step, s M
/// + t C_d + K: its inverse says how positions at the step's end follow forces.
class ImplicitStep {
 public:
  ImplicitStep(const LiveBody& body, const ImplicitOptions& options, std::vector<Wall> walls);

  /// From state by h [s] under `push` [d N] beside the body's load [N]. On failure state is not whole.
  ImplicitReport advance(LiveState& state, double h, const Eigen::VectorXd& push);

  [[nodiscard]] const TangentSolver& solver() const noexcept { return solver_; }
  [[nodiscard]] const WallContacts& contacts() const noexcept { return contacts_; }

 private:
  /// Velocity at x is t (x - x0) - q, acceleration s (x - x0) - p.
  struct Kinematics : StepFactors {
    Eigen::VectorXd p, q;
  };

  [[nodiscard]] Kinematics kinematics(const LiveState& state, double h) const;
  double look(const Eigen::VectorXd& x, const LiveState& state, const Eigen::VectorXd& push,
              const Kinematics& step);
  bool set_matrix(const Eigen::VectorXd& x, const LiveState& state, const Kinematics& step, TangentKind kind);
  bool newton_step(Eigen::VectorXd& x, const LiveState& state, const Eigen::VectorXd& push,
                   const Kinematics& step, double& potential);
  [[nodiscard]] double share_left() const noexcept;
  void finish(const Eigen::VectorXd& x, const Eigen::VectorXd& push, const Kinematics& step,
              LiveState& state);

  const LiveBody& body_;
  ImplicitOptions options_;
  TangentSolver solver_;
  WallContacts contacts_;
  LiveMatrix A_, K_, damping_;                                // damping_: b K where the step began
  Eigen::VectorXd forces_, wall_forces_, inertia_, viscous_;  // [d N]
  Index inverted_ = 0;
  double rounding_ = 0.0;          // of forces [N]
  Eigen::VectorXd left_, change_;  // [n]
};

}  // namespace palpate
