// Reports of the WoodenHaptics family's USB board: unnumbered, 14 bytes each way, seven int16.
// Facts from forsslund/haptikfabrikenapi, firmware/main.cpp and src/fsusbhapticdevicethread.cpp.
//
// The board answers: it sends when it was told something, and is told a first report of zeros to start. Half
// a second after the last report it switches its amplifiers off.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "meshes/mesh.h"
#include "runtime/devices/reports/woodenhaptics_arm.h"
#include "runtime/safety/device.h"

namespace palpate {

constexpr std::size_t woodenhaptics_report_bytes = 14;  ///< without a report id

/// What the board said.
struct EncoderReport {
  std::array<std::int16_t, 6> counters{};  ///< a..f; d without the button
  bool button = false;                     ///< the handle's, which is sent as 10000 counts on d
  bool calibrate = false;                  ///< the button on the board was pressed and not yet answered
};

/// Empty where `report` is not 14 bytes, or its last number neither 0 nor 1.
[[nodiscard]] std::optional<EncoderReport> decode_encoders(std::span<const std::uint8_t> report) noexcept;

/// As hidapi writes it: the report id 0, then the report.
using WoodenHapticsCommand = std::array<std::uint8_t, 1 + woodenhaptics_report_bytes>;

/// Motor currents a, b, c [A], to the milliampere.
[[nodiscard]] WoodenHapticsCommand encode_currents(const Vec3& currents) noexcept;

/// Sets the counters a..f: the answer to `calibrate`, with the device in its calibration pose. No current
/// flows.
[[nodiscard]] WoodenHapticsCommand encode_counters(const std::array<std::int16_t, 6>& counters) noexcept;

/// Pose and button of the handle; without velocity, time and number.
[[nodiscard]] DeviceState arm_state(const ArmConstants& arm, const EncoderReport& report) noexcept;

}  // namespace palpate
