// What the runtime and a bridge, another process that has the device, tell each other: one datagram each way.
// Numbers low byte first, SI units, right-handed axes: x right, y from the user, z up.
//
//     state, device to runtime, 128 bytes        command, runtime to device, 160 bytes
//     byte type  what                             byte type  what
//       0  4 u8  "PLPS"                             0  4 u8  "PLPC"
//       4  u16   version, 2                         4  u16   version, 2
//       6  u16   size, 128                          6  u16   size, 160
//       8  u64   nonce; 0: hello                    8  u64   nonce
//      16  u32   sequence                          16  u32   sequence
//      20  u32   bits 0-15: buttons; 16: a hand    20  u32   sequence of the state that it answers
//                holds it; 17: device fault        24  u64   time, monotonic [ns]
//      24  u64   time, monotonic [ns]              32  u32   mode: 0 zero, 1 force, 2 local model
//      32  3 f64 position [m]                      36  f32   damping b [N s/m]
//      56  3 f64 velocity [m/s]                    40  3 f64 force F on the hand [N]
//      80  4 f32 orientation w, x, y, z            64  3 f64 point x0 [m]
//      96  f32   gripper [rad]                     88  3 f32 torque T on the hand [N m]
//     100  f32   largest force [N]                100  6 f32 stiffness K xx, yy, zz, xy, yz, zx [N/m]
//     104  f32   largest torque [N m]             124  f32   radius [m]
//     108  f32   largest stiffness [N/m]          128  u16   time to live [ms]
//     112  f32   largest damping [N s/m]          130  u16   then to no force in [ms]
//     116  f32   radius of the workspace [m]      132  f32   largest force [N]
//     120  8 u8  seal                             136  16 u8 0
//                                                  152  8 u8  seal
//
// A limit of 0 is not said. The seal is that of bridge_key.h; the encoders leave it 0, the decoders don't
// look at it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "runtime/safety/device.h"

namespace palpate {

constexpr std::size_t bridge_state_bytes = 128;
constexpr std::size_t bridge_command_bytes = 160;
constexpr std::uint16_t bridge_version = 2;

/// Why a datagram is not taken. The first six are said by the decoders, the others by who listens.
enum class Refusal : std::uint8_t {
  none = 0,
  size = 1,         ///< not as long as it should be, or as it says
  magic = 2,        ///< does not begin as one of ours
  version = 3,      ///< another version of the layout
  not_finite = 4,   ///< a number that is infinite or none
  implausible = 5,  ///< a number out of the bounds that the decoder names
  orientation = 6,  ///< the quaternion's length is not 1 within 1 %
  address = 7,      ///< from somebody else than the partner
  hello = 8,        ///< a bridge without a nonce: it is answered
  wrong_nonce = 9,  ///< a bridge of another session: it is answered
  order = 10,       ///< its number is not ahead of the last one's
  time = 11,        ///< its time stands still or goes back
  age = 12,         ///< it was too long on its way
  seal = 13,        ///< from somebody without the key: it is not answered
};

/// The refusals and their names, for reports.
inline constexpr std::array<std::pair<Refusal, const char*>, 14> refusal_names = {{
    {Refusal::none, "none"},
    {Refusal::size, "size"},
    {Refusal::magic, "magic"},
    {Refusal::version, "version"},
    {Refusal::not_finite, "not_finite"},
    {Refusal::implausible, "implausible"},
    {Refusal::orientation, "orientation"},
    {Refusal::address, "address"},
    {Refusal::hello, "hello"},
    {Refusal::wrong_nonce, "wrong_nonce"},
    {Refusal::order, "order"},
    {Refusal::time, "time"},
    {Refusal::age, "age"},
    {Refusal::seal, "seal"},
}};

/// What a bridge says.
struct BridgeState {
  std::uint64_t nonce = 0;  ///< of the runtime that it listens to; 0: of none yet
  std::uint64_t time = 0;   ///< when it was measured, by the bridge's own monotonic clock [ns]
  DeviceState device;       ///< but for `arrived`; 16 buttons
  double gripper = 0.0;     ///< [rad]
  DeviceLimits limits;
  bool in_use = false;  ///< a hand holds the device
  bool fault = false;   ///< the device cannot be used
};

/// Fills `state`, the orientation normalised and `arrived` 0, or says why not. Plausible are positions within
/// 10 m, speeds to 100 m/s, gripper angles within 2 pi and limits that are not negative.
[[nodiscard]] Refusal decode_bridge_state(std::span<const std::uint8_t> datagram,
                                          BridgeState& state) noexcept;
/// What a bridge does.
[[nodiscard]] std::array<std::uint8_t, bridge_state_bytes> encode_bridge_state(
    const BridgeState& state) noexcept;

enum class BridgeMode : std::uint32_t {
  zero = 0,         ///< no force
  force = 1,        ///< force and torque as they are
  local_model = 2,  ///< force - stiffness (x - point) - damping v, and torque
};

/// What a bridge is told. Of `command.local` the force is not sent: it is the wrench's.
struct BridgeCommand {
  std::uint64_t nonce = 0;
  std::uint64_t time = 0;      ///< when it was sent, by the runtime's monotonic clock [ns]
  std::uint32_t sequence = 0;  ///< counts commands
  std::uint32_t answers = 0;   ///< the number of the state from which it follows
  BridgeMode mode = BridgeMode::zero;
  DeviceCommand command;
  double damping = 0.0;            ///< b [N s/m]
  std::uint16_t time_to_live = 0;  ///< from its arrival it is shown whole for so long ...  [ms]
  std::uint16_t fade = 0;          ///< ... and is gone after so much more [ms]
  double max_force = 0.0;          ///< no more is shown; 0: not said [N]
};

/// Fills `command` or says why not. Plausible are modes to 2, and damping, radius and largest force that are
/// not negative.
[[nodiscard]] Refusal decode_bridge_command(std::span<const std::uint8_t> datagram,
                                            BridgeCommand& command) noexcept;
[[nodiscard]] std::array<std::uint8_t, bridge_command_bytes> encode_bridge_command(
    const BridgeCommand& command) noexcept;

}  // namespace palpate
