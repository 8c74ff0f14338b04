// Where the device's frame lies in the body's, and what one unit of motion and force there is here.
#pragma once

#include "runtime/safety/device.h"

namespace palpate {

struct WorkspaceOptions {
  Vec3 device_origin = Vec3::Zero();                         ///< of the device's frame [m] ...
  Vec3 body_origin = Vec3::Zero();                           ///< ... lies here in the body's [m]
  Eigen::Quaterniond axes = Eigen::Quaterniond::Identity();  ///< turns the device's axes into the body's
  double motion_scale = 1.0;                                 ///< s: metres in the body for one of the device
  double force_scale = 1.0;                                  ///< c: newtons on the hand for one of the body
};

/// With R the axes, s the scale of motion and c the scale of force,
///
///     x_body = o_body + s R (x_device - o_device)          f_device = c R^T f_body
///     K_device = -df_device/dx_device = s c R^T K_body R    B_device = s c R^T B_body R
///
/// Angles are not scaled. A lever of l metres in the body is one of l / s in the hand, so torque scales by c
/// / s; then all work on the hand, f.dx + t.dw, is c / s that of the body, and what is passive there is so
/// here.
class Workspace {
 public:
  /// Throws Error for scales that are not positive numbers, origins that are not finite, or axes of length 0.
  explicit Workspace(const WorkspaceOptions& options = {});

  [[nodiscard]] Vec3 position_in_body(const Vec3& device) const noexcept;
  [[nodiscard]] Vec3 position_in_device(const Vec3& body) const noexcept;

  /// Pose and velocity in the body's frame.
  [[nodiscard]] DeviceState in_body(const DeviceState& device) const noexcept;

  /// The hand's wrench and local model, from the body's.
  [[nodiscard]] DeviceCommand in_device(const DeviceCommand& body) const noexcept;

  /// What the body's side may use for the device to stay within its limits: force F / c, torque T s / c,
  /// stiffness K / (s c), damping B / (s c), reach s r.
  [[nodiscard]] DeviceLimits in_body(const DeviceLimits& device) const noexcept;

 private:
  WorkspaceOptions options_;
  Mat3 axes_;
};

}  // namespace palpate
