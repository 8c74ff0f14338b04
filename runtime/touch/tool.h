// What touches the body.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>
#include <optional>

#include "meshes/mesh.h"

namespace palpate {

/// A rigid tool: all points within `radius` of its core, the segment of `length` from the tool's origin along
/// its own z axis (in the plane: its own y axis), or a flat disc around the origin, normal to that axis, that
/// makes the whole tool as wide as `disc_radius`. With neither it is a sphere, with radius 0 a point or a
/// needle. It hangs on the device by a spring, the virtual coupling, which is in series with the body: what
/// the hand feels is never stiffer than the coupling.
struct Tool {
  double radius = 0.0;       ///< [m]
  double length = 0.0;       ///< [m]
  double disc_radius = 0.0;  ///< of a disc with its edge, which is rounded by `radius`: at least that, and
                             ///< the length is 0 [m]
  double coupling_stiffness =
      std::numeric_limits<double>::infinity();  ///< [N/m]; infinite: the tool is where the device is
  double coupling_torsion =
      std::numeric_limits<double>::infinity();  ///< [N m/rad]; infinite: it is turned as the device is
  double max_force = std::numeric_limits<double>::infinity();  ///< the largest that the hand is given [N]
  double hand_over = 0.005;  ///< what of a force may change in a millisecond that the tool's motion does not
                             ///< explain: infinite for the contact's own force without any smoothing [-]
  double reach = 0.0;  ///< a grab that touches nothing holds the nearest surface within this distance of the
                       ///< origin [m]
  std::optional<double> friction{};  ///< Coulomb's coefficient, in place of the material's
};

/// Where the device wants the tool. On a body in the plane z is ignored, and so is what turns the tool out of
/// it.
struct ToolPose {
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  Vec3 position = Vec3::Zero();  ///< of the tool's origin [m]
  bool grab = false;             ///< the tool wants to hold what it touches
};

/// A force and its torque about the tool's origin.
struct Wrench {
  Vec3 force = Vec3::Zero();   ///< [N]
  Vec3 torque = Vec3::Zero();  ///< [N m]; in the plane about z
};

}  // namespace palpate
