// What moves a tool and shows its force: a haptic device, a mouse, a script, another process.
#pragma once

#include <cstdint>
#include <limits>

#include "runtime/local_model.h"
#include "runtime/tool.h"

namespace palpate {

/// What a device can bear and reach, in SI units; infinite where it does not say. (CHAI3D keeps the same
/// record.)
struct DeviceLimits {
  double max_force = std::numeric_limits<double>::infinity();         ///< [N]
  double max_torque = std::numeric_limits<double>::infinity();        ///< [N m]
  double max_stiffness = std::numeric_limits<double>::infinity();     ///< in closed loop at 1 kHz [N/m]
  double max_damping = std::numeric_limits<double>::infinity();       ///< in closed loop at 1 kHz [N s/m]
  double workspace_radius = std::numeric_limits<double>::infinity();  ///< [m]
};

/// What a device said last.
struct DeviceState {
  ToolPose pose;                 ///< of the handle, in the device's own frame [m]; grab: button 0
  Vec3 velocity = Vec3::Zero();  ///< [m/s]
  std::uint32_t buttons = 0;     ///< bit k: button k is down
  std::int64_t arrived = 0;      ///< when, by the monotonic clock [ns]
  std::uint32_t sequence = 0;    ///< counts what was said
};

/// What a device is to show: at its own rate force - stiffness (x - point) within the local model's radius,
/// or where it cannot, the force.
struct DeviceCommand {
  Wrench wrench;     ///< on the hand
  LocalModel local;  ///< of wrench.force
};

}  // namespace palpate
