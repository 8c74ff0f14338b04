// Rest under loads: Newton's method on the internal forces.
#pragma once

#include <Eigen/Core>
#include <span>

#include "statics/live_body.h"

namespace palpate {

struct BalanceOptions {
  double tolerance =
      1e-10;            ///< norm of the forces left on free dofs, of the largest norm of forces in the way
  int most_steps = 60;  ///< of Newton's method
};

struct BalanceReport {
  bool converged = false;
  int steps = 0;
  double residual = 0.0;  ///< as `tolerance` has it
  Index inverted = 0;     ///< quadrature points at the end
};

/// Moves the free dofs of x [d N] to where internal forces and `load` [d N] balance, held dofs as x has them.
/// Plastic strain stays as it is (empty: none). Steps by the exact tangent where that is positive definite,
/// else by the positive one, and shortens them until the energy falls. The body must be held against rigid
/// motion.
BalanceReport find_balance(const LiveBody& body, const Eigen::VectorXd& load, std::span<const Mat3> plastic,
                           Eigen::VectorXd& x, const BalanceOptions& options = {});

}  // namespace palpate
