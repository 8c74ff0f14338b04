// What the hand feels near where it is.
#pragma once

#include <Eigen/Core>

#include "meshes/mesh.h"

namespace palpate {

/// What the hand feels near a place of the device: force(x) = force - stiffness (x - point) for |x - point|
/// up to `radius`. For devices that run faster than the tick, and for ticks that come late.
struct LocalModel {
  Vec3 force = Vec3::Zero();                            ///< on the hand with the device at `point` [N]
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();  ///< symmetric, positive semidefinite [N/m]
  Vec3 point = Vec3::Zero();                            ///< of the device [m]
  double radius = 0.0;  ///< how far it may move before a contact is made or broken, or curvature counts [m]
};

}  // namespace palpate
