// How a body keeps its dents (Parker & O'Brien 2009; theory.md section 7).
#pragma once

#include <Eigen/Core>
#include <span>

#include "statics/live_body.h"

namespace palpate {

/// What flowed in a step.
struct FlowSums {
  double work = 0.0;  ///< plastic work: what the elastic energy loses as it flows [J]
  Index flowing = 0;  ///< quadrature points above the yield
};

/// One step of flow in `time` [s] at positions x [d N]: at each quadrature point whose elastic strain is
/// above the yield y, plastic strain grows by c (|e| - y) / |e| e with c = 1 - exp(-creep time), so that what
/// is above the yield dies away at the rate `creep` however long the steps are; then it is scaled back to its
/// maximum. `plastic` strain of each point.
FlowSums flow(const LiveBody& body, const Eigen::VectorXd& x, double time, std::span<Mat3> plastic);

}  // namespace palpate
