// Reports of the WoodenHaptics family's USB board: unnumbered, 14 bytes each way, seven int16.
// Facts from forsslund/haptikfabrikenapi, firmware/main.cpp and src/fsusbhapticdevicethread.cpp.
//
// The board sends only in answer to a report; a first report of zeros starts it. Half a second after the last
// report it switches its amplifiers off.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "base/vectors.h"
#include "runtime/devices/reports/woodenhaptics_arm.h"
#include "runtime/safety/device.h"

namespace palpate {

constexpr std::size_t woodenhaptics_report_bytes = 14;  ///< without the report id

/// Contents of a report from the board.
struct EncoderReport {
  std::array<std::int16_t, 6> counters{};  ///< a..f; d with the button's offset removed
  bool button = false;                     ///< button of the handle, which is sent as 10000 counts on d
  bool calibrate = false;                  ///< the button on the board was pressed and is not yet answered
};

/// Decodes a report. Empty unless it has 14 bytes and its last number is 0 or 1.
[[nodiscard]] std::optional<EncoderReport> decode_encoders(std::span<const std::uint8_t> report) noexcept;

/// Report as hidapi writes it: the report id 0, then its contents.
using WoodenHapticsCommand = std::array<std::uint8_t, 1 + woodenhaptics_report_bytes>;

/// Encodes the motor currents a, b, c [A], to the milliampere.
[[nodiscard]] WoodenHapticsCommand encode_currents(const Vec3& currents) noexcept;

/// Encodes the counters a..f: the answer to `calibrate`, with the device in its calibration pose. No current
/// flows.
[[nodiscard]] WoodenHapticsCommand encode_counters(const std::array<std::int16_t, 6>& counters) noexcept;

/// Returns pose and button of the handle; without velocity, time and sequence number.
[[nodiscard]] DeviceState arm_state(const ArmConstants& arm, const EncoderReport& report) noexcept;

}  // namespace palpate
