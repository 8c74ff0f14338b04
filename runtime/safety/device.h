// Interface to a device that moves a tool and displays its force: a haptic device, a mouse, a script, another
// process.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "runtime/core/tick/local_model.h"
#include "runtime/core/touch/tool.h"

namespace palpate {

/// Limits of a device in SI units; infinite if the device does not state one. (CHAI3D keeps the same record.)
struct DeviceLimits {
  double max_force = std::numeric_limits<double>::infinity();         ///< [N]
  double max_torque = std::numeric_limits<double>::infinity();        ///< [N m]
  double max_stiffness = std::numeric_limits<double>::infinity();     ///< in a closed loop at 1 kHz [N/m]
  double max_damping = std::numeric_limits<double>::infinity();       ///< in a closed loop at 1 kHz [N s/m]
  double workspace_radius = std::numeric_limits<double>::infinity();  ///< [m]
};

/// Latest state reported by a device.
struct DeviceState {
  ToolPose pose;                 ///< pose of the handle in the device's own frame [m]; button 0 grabs
  Vec3 velocity = Vec3::Zero();  ///< [m/s]
  std::uint32_t buttons = 0;     ///< bit k: button k is down
  std::int64_t arrived = 0;      ///< time of arrival, CLOCK_MONOTONIC [ns]
  std::uint32_t sequence = 0;    ///< sequence number of the report
};

/// Command to a device. At its own rate it displays force - stiffness (x - point) within the radius of the
/// local model; a device that cannot do so displays the force alone.
struct DeviceCommand {
  Wrench wrench;     ///< wrench on the hand
  LocalModel local;  ///< linearisation of wrench.force
};

/// Events of a device since the last tick; a bit mask.
enum class DeviceEvent : std::uint8_t {
  none = 0,
  opened_again = 1U << 0,  ///< the device was lost and is back
  lost = 1U << 1,          ///< the device was unplugged, or cannot be read or written
  acknowledged = 1U << 2,  ///< a person has acknowledged the fault
  input_lost = 1U << 3,    ///< the viewer that moved the tool is gone
  lifted = 1U << 4,   ///< the tool hovers: it is placed directly where it is lowered, and the path there is
                      ///< not felt
  resumed = 1U << 5,  ///< the loop resumed after a pause: force restarts from zero
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

/// Number and times of a tick of the loop.
struct TickTime {
  std::int64_t number = 0;  ///< from 0
  std::int64_t due = 0;     ///< time at which it should begin, CLOCK_MONOTONIC [ns]
  std::int64_t begun = 0;   ///< time at which it began [ns]
};

/// Input of a device to a tick.
struct DeviceNews {
  DeviceState state;
  DeviceEvent events = DeviceEvent::none;
  std::optional<std::int64_t> begun{};  ///< in a replay: start time of the recorded tick, which replaces the
                                        ///< current time [ns]
};

/// Device as the loop uses it. Neither call waits, allocates or throws.
class Device {
 public:
  virtual ~Device() = default;

  /// Returns the latest state and the events since the last call; the previous state if no new report has
  /// arrived.
  virtual DeviceNews poll(const TickTime& tick) noexcept = 0;

  /// Displays `command`, which was computed from `state` in a tick that began at `begun` [ns].
  virtual void display(const DeviceCommand& command, const DeviceState& state,
                       std::int64_t begun) noexcept = 0;
};

}  // namespace palpate
