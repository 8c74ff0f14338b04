// Map between the device's and the body's frame, with scales of motion and force.
#pragma once

#include "runtime/safety/device.h"

namespace palpate {

struct WorkspaceOptions {
  Vec3 device_origin = Vec3::Zero();                         ///< origin in the device frame [m]
  Vec3 body_origin = Vec3::Zero();                           ///< device_origin in the body frame [m]
  Eigen::Quaterniond axes = Eigen::Quaterniond::Identity();  ///< device axes to body axes
  double motion_scale = 1.0;                                 ///< s: metres in the body per device metre
  double force_scale = 1.0;                                  ///< c: newtons on the hand per body newton
};

/// Map between device and body. With R the axes, s the scale of motion and c the scale of force,
///
///     x_body = o_body + s R (x_device - o_device)          f_device = c R^T f_body
///     K_device = -df_device/dx_device = s c R^T K_body R    B_device = s c R^T B_body R
///
/// Angles are not scaled. A lever of l metres in the body is one of l / s in the hand, so torque scales by c
/// / s. All work on the hand, f.dx + t.dw, is then c / s times that on the body, so a passive body stays
/// passive for the hand.
class Workspace {
 public:
  /// Throws Error if a scale is not a positive number, an origin is not finite, or the axes have length 0.
  explicit Workspace(const WorkspaceOptions& options = {});

  [[nodiscard]] Vec3 position_in_body(const Vec3& device) const noexcept;
  [[nodiscard]] Vec3 position_in_device(const Vec3& body) const noexcept;

  /// Returns pose and velocity in the body's frame.
  [[nodiscard]] DeviceState in_body(const DeviceState& device) const noexcept;

  /// Returns wrench and local model for the hand, from the body's.
  [[nodiscard]] DeviceCommand in_device(const DeviceCommand& body) const noexcept;

 private:
  WorkspaceOptions options_;
  Mat3 axes_;
};

}  // namespace palpate
