// Kinematics of the WoodenHaptics family: WoodenHaptics, AluHaptics and Polhem v1.
// Facts from forsslund/haptikfabrikenapi, src/kinematics.cpp and src/haptikfabrikenapi.h.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>

#include "base/vectors.h"

namespace palpate {

/// Geometry and drives of an arm. Body a turns about the vertical z axis and carries the links b and c, which
/// lie in one vertical plane and are driven from a's foot by capstans. Joint angles [rad]: A of that plane
/// about z, B of link b from vertically up, C of link c from vertically down. The wrist of a 6-DoF device
/// turns by D, E, F about link c's own x, y, x axes and has no motors.
struct ArmConstants {
  Vec3 lengths = Vec3::Zero();                ///< height of b's joint over the ground, lengths of b and c [m]
  Vec3 capstan_diameters = Vec3::Zero();      ///< [m]
  Vec3 body_diameters = Vec3::Zero();         ///< diameters of the bodies driven by the capstans [m]
  Vec3 torque_constants = Vec3::Zero();       ///< motors [N m/A]
  double max_current = 0.0;                   ///< largest current of one motor [A]
  std::array<double, 6> counts_per_turn{};    ///< encoders A..F (four per line); D..F 0: no wrist
  std::array<bool, 3> motor_aligned{};        ///< A..C: the motor points along the joint's axis
  std::array<bool, 3> encoder_aligned{};      ///< D..F: counts increase with the joint's angle
  std::array<std::int16_t, 6> calibration{};  ///< counters a..f in the calibration pose
  Vec3 workspace_origin = Vec3::Zero();       ///< point at which the position is 0 [m]

  [[nodiscard]] bool has_wrist() const noexcept {
    return counts_per_turn[3] > 0.0 && counts_per_turn[4] > 0.0 && counts_per_turn[5] > 0.0;
  }
};

/// Joint angles A, B, C [rad] from the counters a, b, c.
[[nodiscard]] Vec3 joint_angles(const ArmConstants& arm,
                                const std::array<std::int16_t, 6>& counters) noexcept;

/// Joint angles D, E, F [rad]. The wrist is wired from the tip: joint D is counter f, E is e, F is d.
[[nodiscard]] Vec3 wrist_angles(const ArmConstants& arm,
                                const std::array<std::int16_t, 6>& counters) noexcept;

/// Position of the handle relative to the workspace's origin, x outwards, z up [m].
[[nodiscard]] Vec3 arm_position(const ArmConstants& arm, const Vec3& angles) noexcept;

/// Jacobian d position / d angles [m/rad].
[[nodiscard]] Mat3 arm_jacobian(const ArmConstants& arm, const Vec3& angles) noexcept;

/// Orientation of the handle: Rz(A) Ry(pi/2 - C) Rx(D) Ry(E) Rx(F); identity without a wrist.
[[nodiscard]] Eigen::Quaterniond arm_orientation(const ArmConstants& arm, const Vec3& angles,
                                                 const Vec3& wrist) noexcept;

/// Returns the angles that put the handle at `position`: in front of the axis, elbow up. Empty if out of
/// reach or on the axis, where A is undefined.
[[nodiscard]] std::optional<Vec3> inverse_arm(const ArmConstants& arm, const Vec3& position) noexcept;

/// Returns the motor currents a, b, c [A] that display `force` [N] on the hand: joint torques J^T F through
/// the capstans. All are scaled together if one would exceed `max_current`.
[[nodiscard]] Vec3 motor_currents(const ArmConstants& arm, const Vec3& angles, const Vec3& force) noexcept;

}  // namespace palpate
