// Equilibrium under loads: Newton's method on the internal forces.
#pragma once

#include <Eigen/Core>
#include <span>

#include "statics/live_body.h"

namespace palpate {

struct BalanceOptions {
  double tolerance = 1e-10;  ///< norm of the residual forces on free dofs, relative to the largest norm of
                             ///< forces so far
  int most_steps = 60;       ///< Newton steps
};

struct BalanceReport {
  bool converged = false;
  int steps = 0;
  double residual = 0.0;  ///< in the measure of `tolerance`
  Index inverted = 0;     ///< inverted quadrature points at the end
};

/// Moves the free dofs of x [d N] to equilibrium of the internal forces and `load` [d N]; held dofs stay as
/// in x. Plastic strain is constant (empty: none). Steps use the exact tangent if it is positive definite,
/// else the positive one, and are shortened until the energy falls. The body must be held against rigid
/// motion.
BalanceReport find_balance(const LiveBody& body, const Eigen::VectorXd& load, std::span<const Mat3> plastic,
                           Eigen::VectorXd& x, const BalanceOptions& options = {});

}  // namespace palpate
