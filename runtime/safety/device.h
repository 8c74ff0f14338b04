// What moves a tool and shows its force: a haptic device, a mouse, a script, another process.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "runtime/tick/local_model.h"
#include "runtime/touch/tool.h"

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

/// What befell a device since the tick before; bits.
enum class DeviceEvent : std::uint8_t {
  none = 0,
  opened_again = 1U << 0,  ///< it was lost and is back
  lost = 1U << 1,          ///< unplugged, or it cannot be read or written
  acknowledged = 1U << 2,  ///< a person has seen the fault
  input_lost = 1U << 3,    ///< the viewer that moved the tool is gone
  lifted = 1U << 4,   ///< the tool hovers: it is put down where it is let down, and nothing is felt of the
                      ///< way there
  resumed = 1U << 5,  ///< the loop goes on after a pause: force begins anew
};

constexpr DeviceEvent operator|(DeviceEvent a, DeviceEvent b) noexcept {
  return static_cast<DeviceEvent>(static_cast<unsigned>(a) | static_cast<unsigned>(b));
}
constexpr DeviceEvent& operator|=(DeviceEvent& a, DeviceEvent b) noexcept {
  return a = a | b;
}
constexpr bool has(DeviceEvent events, DeviceEvent bit) noexcept {
  return (static_cast<unsigned>(events) & static_cast<unsigned>(bit)) != 0;
}

/// A tick of the loop.
struct TickTime {
  std::int64_t number = 0;  ///< from 0
  std::int64_t due = 0;     ///< when it was to begin, by the monotonic clock [ns]
  std::int64_t begun = 0;   ///< when it did [ns]
};

/// What a device has to say to a tick.
struct DeviceNews {
  DeviceState state;
  DeviceEvent events = DeviceEvent::none;
  std::optional<std::int64_t> begun{};  ///< in a replay: when the recorded tick began, in place of now [ns]
};

/// What the loop drives a tool with. Neither call waits, allocates or throws.
class Device {
 public:
  virtual ~Device() = default;

  /// What is known of the device now; the same state as before when nothing new was heard.
  virtual DeviceNews poll(const TickTime& tick) noexcept = 0;

  /// What it is to show, which follows from `state` in a tick that began at `begun`.
  virtual void display(const DeviceCommand& command, const DeviceState& state,
                       std::int64_t begun) noexcept = 0;
};

}  // namespace palpate
