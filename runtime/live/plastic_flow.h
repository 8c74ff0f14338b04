// Plastic flow, by which a body keeps dents (Parker & O'Brien 2009; theory.md section 7).
#pragma once

#include <Eigen/Core>
#include <span>

#include "statics/live_body.h"

namespace palpate {

/// Plastic flow in a step.
struct FlowSums {
  double work = 0.0;  ///< plastic work: loss of elastic energy by flow [J]
  Index flowing = 0;  ///< quadrature points above the yield strain
};

/// Performs one step of flow in `time` [s] at positions x [d N]. At each quadrature point whose elastic
/// strain exceeds the yield strain y, plastic strain grows by c (|e| - y) / |e| e with c = 1 - exp(-creep
/// time), so that the excess decays at the rate `creep` for any step length; it is then scaled back to its
/// maximum. `plastic`: plastic strain of each point.
FlowSums flow(const LiveBody& body, const Eigen::VectorXd& x, double time, std::span<Mat3> plastic);

}  // namespace palpate
