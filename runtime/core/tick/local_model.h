// Local model of the force on the hand.
#pragma once

#include <Eigen/Core>

#include "base/vectors.h"

namespace palpate {

/// Linear model of the force on the hand: force(x) = force - stiffness (x - point) for |x - point| up to
/// `radius`. For devices that run faster than the tick, and for late ticks.
struct LocalModel {
  Vec3 force = Vec3::Zero();                            ///< on the hand, with the device at `point` [N]
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();  ///< symmetric, positive semidefinite [N/m]
  Vec3 point = Vec3::Zero();                            ///< position of the device [m]
  double radius = 0.0;  ///< range before a contact opens or closes, or curvature matters [m]
};

}  // namespace palpate
