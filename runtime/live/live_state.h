// State of a live body.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "statics/live_body.h"

namespace palpate {

/// Positions and velocities of a body. Copies are complete.
struct LiveState {
  /// At rest in the shape of the mesh, held nodes at their prescribed position.
  explicit LiveState(const LiveBody& body);

  Eigen::VectorXd x;          ///< [d N] positions [m]
  Eigen::VectorXd v;          ///< [d N] velocities [m/s]
  std::vector<Mat3> plastic;  ///< [quadrature points] plastic strain; empty without plasticity
  double time = 0.0;          ///< [s]
};

}  // namespace palpate
