// The messages of bridge_wire.h as the runtime has them: states are checked, commands made.
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/devices/bridge/bridge_wire.h"
#include "runtime/safety/device.h"
#include "runtime/safety/safety_options.h"

namespace palpate {

/// Why a message or a bridge is not taken.
enum class Refusal : std::uint8_t {
  none,
  size,         ///< not as long as it should be
  version,      ///< does not begin as one of ours, or has another layout
  not_finite,   ///< a number that is infinite or none
  implausible,  ///< beyond 10 m or 100 m/s, or a limit below 0
  orientation,  ///< the quaternion's length is not 1 within 1 %
  age,          ///< 20 ms old, or ahead of this machine's clock
  user,         ///< the bridge is another user's
};

/// A bridge's state.
struct BridgeState {
  DeviceState device;
  DeviceLimits limits;
  bool fault = false;  ///< the device cannot be used
};

/// Fills `state`, the orientation normalised, from a message of `size` bytes that arrived at `now` [ns], or
/// says why not.
[[nodiscard]] Refusal read_bridge_state(const bridge_state& said, std::size_t size, std::int64_t now,
                                        BridgeState& state) noexcept;

/// The command that answers the state of number `answers`. One with numbers that are not finite is without
/// force.
[[nodiscard]] bridge_command make_bridge_command(const DeviceCommand& command, std::uint32_t answers,
                                                 const StaleOptions& stale, double max_force) noexcept;

}  // namespace palpate
