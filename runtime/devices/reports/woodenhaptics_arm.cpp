#include "runtime/devices/reports/woodenhaptics_arm.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "runtime/safety/saturation.h"

namespace palpate {
namespace {

constexpr double turn = 2.0 * std::numbers::pi;

/// Joint angle per motor angle, signed: a capstan whose motor points along the joint's axis reverses the
/// sense.
Vec3 transmission(const ArmConstants& arm) noexcept {
  Vec3 ratio = arm.capstan_diameters.cwiseQuotient(arm.body_diameters);
  for (int i = 0; i < 3; ++i) {
    if (arm.motor_aligned[static_cast<std::size_t>(i)]) ratio[i] = -ratio[i];
  }
  return ratio;
}

}  // namespace

Vec3 joint_angles(const ArmConstants& arm, const std::array<std::int16_t, 6>& counters) noexcept {
  Vec3 motor;
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    motor[i] = turn * counters[k] / arm.counts_per_turn[k];
  }
  return motor.cwiseProduct(transmission(arm));
}

Vec3 wrist_angles(const ArmConstants& arm, const std::array<std::int16_t, 6>& counters) noexcept {
  if (!arm.has_wrist()) return Vec3::Zero();
  Vec3 angles;
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double angle = turn * counters[5 - k] / arm.counts_per_turn[3 + k];
    angles[i] = arm.encoder_aligned[k] ? angle : -angle;
  }
  return angles;
}

Vec3 arm_position(const ArmConstants& arm, const Vec3& angles) noexcept {
  const double reach = arm.lengths[1] * std::sin(angles[1]) + arm.lengths[2] * std::sin(angles[2]);
  const double height =
      arm.lengths[0] + arm.lengths[1] * std::cos(angles[1]) - arm.lengths[2] * std::cos(angles[2]);
  return Vec3(std::cos(angles[0]) * reach, std::sin(angles[0]) * reach, height) - arm.workspace_origin;
}

Mat3 arm_jacobian(const ArmConstants& arm, const Vec3& angles) noexcept {
  const double L_b = arm.lengths[1];
  const double L_c = arm.lengths[2];
  const double sin_A = std::sin(angles[0]), cos_A = std::cos(angles[0]);
  const double sin_B = std::sin(angles[1]), cos_B = std::cos(angles[1]);
  const double sin_C = std::sin(angles[2]), cos_C = std::cos(angles[2]);
  const double reach = L_b * sin_B + L_c * sin_C;
  Mat3 J;
  J << -sin_A * reach, cos_A * L_b * cos_B, cos_A * L_c * cos_C,  //
      cos_A * reach, sin_A * L_b * cos_B, sin_A * L_c * cos_C,    //
      0.0, -L_b * sin_B, L_c * sin_C;
  return J;
}

Eigen::Quaterniond arm_orientation(const ArmConstants& arm, const Vec3& angles, const Vec3& wrist) noexcept {
  if (!arm.has_wrist()) return Eigen::Quaterniond::Identity();
  using Turn = Eigen::AngleAxisd;
  return Turn(angles[0], Vec3::UnitZ()) * Turn(std::numbers::pi / 2.0 - angles[2], Vec3::UnitY()) *
         Turn(wrist[0], Vec3::UnitX()) * Turn(wrist[1], Vec3::UnitY()) * Turn(wrist[2], Vec3::UnitX());
}

std::optional<Vec3> inverse_arm(const ArmConstants& arm, const Vec3& position) noexcept {
  const Vec3 p = position + arm.workspace_origin;
  const double reach = std::hypot(p.x(), p.y());
  const double height = p.z() - arm.lengths[0];
  const double L_b = arm.lengths[1];
  const double L_c = arm.lengths[2];
  const double distance = std::hypot(reach, height);
  if (!(reach > 0.0) || !(distance <= L_b + L_c) || distance < std::abs(L_b - L_c)) return std::nullopt;
  // Triangle of b, c and the line from b's joint to the handle, by the law of cosines.
  const double cosine = (L_b * L_b + distance * distance - L_c * L_c) / (2.0 * L_b * distance);
  const double B = std::atan2(reach, height) - std::acos(std::clamp(cosine, -1.0, 1.0));
  const double C = std::atan2(reach - L_b * std::sin(B), L_b * std::cos(B) - height);
  return Vec3(std::atan2(p.y(), p.x()), B, C);
}

Vec3 motor_currents(const ArmConstants& arm, const Vec3& angles, const Vec3& force) noexcept {
  const Vec3 joint_torques = arm_jacobian(arm, angles).transpose() * force;
  const Vec3 motor_torques = joint_torques.cwiseProduct(transmission(arm));
  return saturate(motor_torques.cwiseQuotient(arm.torque_constants), arm.max_current);
}

}  // namespace palpate
