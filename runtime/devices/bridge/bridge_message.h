// Messages of bridge_wire.h as the runtime uses them: checked states and encoded commands.
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/devices/bridge/bridge_wire.h"
#include "runtime/safety/device.h"
#include "runtime/safety/safety_options.h"

namespace palpate {

/// Reason why a message or a bridge is refused.
enum class Refusal : std::uint8_t {
  none,
  size,         ///< wrong length
  version,      ///< wrong magic bytes, or another version
  not_finite,   ///< a number that is infinite or NaN
  implausible,  ///< beyond 10 m or 100 m/s, or a limit below 0
  orientation,  ///< length of the quaternion not 1 within 1 %
  age,          ///< at least 20 ms old, or ahead of this machine's clock
  user,         ///< the bridge belongs to another user
};

/// State sent by a bridge.
struct BridgeState {
  DeviceState device;
  DeviceLimits limits;
  bool fault = false;  ///< the device cannot be used
};

/// Decodes a message of `size` bytes that arrived at `now` [ns] into `state`, with the orientation
/// normalised, or returns the reason for refusing it.
[[nodiscard]] Refusal read_bridge_state(const bridge_state& said, std::size_t size, std::int64_t now,
                                        BridgeState& state) noexcept;

/// Returns the command that answers the state with sequence number `answers`. If a number is not finite, the
/// command has no force.
[[nodiscard]] bridge_command make_bridge_command(const DeviceCommand& command, std::uint32_t answers,
                                                 const StaleOptions& stale, double max_force) noexcept;

}  // namespace palpate
