// Stability limit of a body's explicit steps.
#pragma once

#include <Eigen/Core>
#include <span>

#include "statics/live_body.h"

namespace palpate {

/// Largest angular frequency of a body at given positions, by power iteration on M^-1 K. It continues from
/// the last vector, so that a few iterations suffice for a moving body.
class LargestFrequency {
 public:
  explicit LargestFrequency(const LiveBody& body);

  /// Performs `rounds` more iterations at positions x [d N] with plastic strain (empty: none). Returns a
  /// lower estimate [rad/s], which for most bodies is within a percent after a hundred iterations.
  double estimate(const Eigen::VectorXd& x, std::span<const Mat3> plastic, int rounds);

 private:
  const LiveBody& body_;
  LiveMatrix K_;
  Eigen::VectorXd shape_;      // [n] sqrt(M) u
  Eigen::VectorXd root_mass_;  // [n]
};

/// The longest stable step of semi-implicit Euler [s] at an angular frequency of the body [rad/s], with its
/// damping: 2 (sqrt(1 + zeta^2) - zeta) / omega; infinity at 0.
double longest_step_at(const LiveBody& body, double omega);

}  // namespace palpate
