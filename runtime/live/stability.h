// How long an explicit step of a body may be.
#pragma once

#include <Eigen/Core>
#include <span>

#include "runtime/live/integrator.h"
#include "statics/live_body.h"

namespace palpate {

/// The largest angular frequency of a body at some positions, by power iteration on M^-1 K. Goes on where it
/// was, so that a few rounds follow a body that moves.
class LargestFrequency {
 public:
  explicit LargestFrequency(const LiveBody& body);

  /// `rounds` more at positions x [d N] with plastic strain (empty: none): an estimate from below [rad/s],
  /// which is within a percent after a hundred rounds at most bodies.
  double estimate(const Eigen::VectorXd& x, std::span<const Mat3> plastic, int rounds);

 private:
  const LiveBody& body_;
  LiveMatrix K_;
  Eigen::VectorXd shape_;      // [n] sqrt(M) u
  Eigen::VectorXd root_mass_;  // [n]
};

/// The longest stable step [s] at an angular frequency of the body [rad/s], with its damping.
double longest_step_at(const LiveBody& body, Integrator integrator, double omega);

}  // namespace palpate
