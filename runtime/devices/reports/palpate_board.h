// Palpate's own reports for home-made boards: any USB microcontroller that measures a handle and drives
// motors. A board with the descriptor below is found by its usage, whatever its ids. All numbers are
// little-endian.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/vectors.h"
#include "runtime/devices/reports/hid_report_descriptor.h"
#include "runtime/safety/device.h"

namespace palpate {

constexpr HidUsage board_usage{0xFF48, 0x01};  ///< vendor page "H", a haptic device
constexpr std::uint8_t board_version = 1;

constexpr int least_board_axes = 3;
constexpr int most_board_axes = 6;

/// Returns the report descriptor of a board with 3 to 6 axes.
[[nodiscard]] std::vector<std::uint8_t> board_report_descriptor(int axes);

// --- input report 1: sequence u32, axes i32 (3 to 6), buttons u16 ---

/// Position x, y, z [um], then as many components of a rotation vector (axis times angle) [urad] as there are
/// axes.
struct BoardInput {
  std::uint32_t sequence = 0;  ///< incremented with each report
  int axes = least_board_axes;
  std::array<std::int32_t, most_board_axes> values{};
  std::uint16_t buttons = 0;  ///< bit k: button k is down
};
constexpr std::size_t board_input_bytes(int axes) noexcept {
  return 1 + 4 + 4 * static_cast<std::size_t>(axes) + 2;
}

/// Decodes a report. Empty for a wrong id or length, a position beyond 10 m or an angle beyond 2 pi.
[[nodiscard]] std::optional<BoardInput> decode_board_input(std::span<const std::uint8_t> report) noexcept;

/// Converts to SI units; without velocity and time.
[[nodiscard]] DeviceState board_state(const BoardInput& input) noexcept;

// --- output report 2: sequence u32, forces i16 (x, y, z) ---

constexpr std::size_t board_force_bytes = 1 + 4 + 3 * 2;

struct BoardForce {
  std::uint32_t sequence = 0;            ///< sequence number of the input report that it answers
  std::array<std::int16_t, 3> counts{};  ///< force on the hand in the board's unit
};
[[nodiscard]] std::array<std::uint8_t, board_force_bytes> encode_board_force(
    const BoardForce& force) noexcept;

// --- feature report 3: version u8, axes u8, watchdog u16, force unit, largest force, stiffness, damping,
// radius u32 ---

constexpr std::size_t board_feature_bytes = 1 + 1 + 1 + 2 + 5 * 4;

/// Properties that a board reports. A limit of 0 is not stated.
struct BoardFeature {
  int axes = least_board_axes;
  std::uint16_t watchdog = 0;          ///< time without a force report until it shows none [ms]; 1 to 1000
  std::uint32_t force_unit = 0;        ///< force per count [uN]; at least 1
  std::uint32_t max_force = 0;         ///< [mN]
  std::uint32_t max_stiffness = 0;     ///< [N/m]
  std::uint32_t max_damping = 0;       ///< [mN s/m]
  std::uint32_t workspace_radius = 0;  ///< [um]

  [[nodiscard]] DeviceLimits limits() const noexcept;
};

/// Decodes a report. Empty for a wrong id, length or version, and for numbers outside the bounds above.
[[nodiscard]] std::optional<BoardFeature> decode_board_feature(std::span<const std::uint8_t> report) noexcept;

/// A force in the board's unit, saturated.
[[nodiscard]] std::array<std::int16_t, 3> board_counts(const BoardFeature& feature,
                                                       const Vec3& force) noexcept;

}  // namespace palpate
