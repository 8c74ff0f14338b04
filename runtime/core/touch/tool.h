// Rigid tools that touch the body.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>
#include <optional>

#include "base/vectors.h"

namespace palpate {

/// Rigid tool: all points within `radius` of its core. The core is a segment of `length` from the tool's
/// origin along its own z axis (in the plane: its own y axis), or a flat disc around the origin, normal to
/// that axis, that gives the whole tool the radius `disc_radius`. With neither, the tool is a sphere, or with
/// radius 0 a point or needle. A spring, the virtual coupling, connects it to the device in series with the
/// body: the hand never feels more than its stiffness.
struct Tool {
  double radius = 0.0;       ///< [m]
  double length = 0.0;       ///< [m]
  double disc_radius = 0.0;  ///< radius of a disc including its edge, which is rounded by `radius`: at least
                             ///< `radius`, with length 0 [m]
  double coupling_stiffness =
      std::numeric_limits<double>::infinity();  ///< [N/m]; infinite: the tool is at the device's position
  double coupling_torsion =
      std::numeric_limits<double>::infinity();  ///< [N m/rad]; infinite: the tool is oriented as the device
  double max_force = std::numeric_limits<double>::infinity();  ///< largest force on the hand [N]
  double hand_over = 0.005;  ///< fraction of the force that may change per millisecond without a matching
                             ///< motion of the tool; infinite: the contact's own force, not smoothed [-]
  double reach = 0.0;  ///< distance from the origin within which a grab without contact holds the nearest
                       ///< surface [m]
  std::optional<double> friction{};  ///< Coulomb coefficient, instead of the material's
};

/// Tool pose requested by the device. On a body in the plane, z and any rotation out of the plane are
/// ignored.
struct ToolPose {
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  Vec3 position = Vec3::Zero();  ///< position of the tool's origin [m]
  bool grab = false;             ///< request to hold the touched surface
};

/// Force and its torque about the tool's origin.
struct Wrench {
  Vec3 force = Vec3::Zero();   ///< [N]
  Vec3 torque = Vec3::Zero();  ///< [N m]; in the plane about z
};

}  // namespace palpate
