// Reports of a force-feedback joystick, encoded by its layout.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "base/vectors.h"
#include "runtime/devices/reports/pid_layout.h"
#include "runtime/safety/device.h"

namespace palpate {

/// Report as hidapi writes it: the report id (0 for unnumbered reports), then its contents.
struct PidReport {
  std::array<std::uint8_t, pid_report_room> bytes{};
  std::size_t size = 0;

  [[nodiscard]] std::span<const std::uint8_t> span() const noexcept { return {bytes.data(), size}; }
};

/// Constants that no descriptor contains and a user has to measure.
struct PidConstants {
  std::array<double, pid_axes> half_travel{};  ///< travel of the handle from centre to stop, x and y [m]
  std::array<double, pid_axes> full_force{};   ///< force on the handle at the largest magnitude, x and y [N]
  /// Direction of the effect whose positive magnitude is a force along +x (right) and +y (away from the user)
  /// [degrees]: by Linux, which follows PID, 0 pulls towards the user, 90 to the left.
  std::array<double, pid_axes> directions{270.0, 180.0};
};

/// Position and buttons of the handle.
struct PidInput {
  std::array<double, pid_axes> axes{};  ///< right and away from the user, -1 to 1 from stop to stop
  std::uint32_t buttons = 0;            ///< bit k: button k is down
};

/// Decodes a report read by hidapi. Empty for another report, a wrong length, or an axis outside its logical
/// range.
[[nodiscard]] std::optional<PidInput> decode_pid_input(const PidLayout& layout,
                                                       std::span<const std::uint8_t> report) noexcept;

/// Converts to a pose in the plane z = 0 [m]; without velocity, time and sequence number.
[[nodiscard]] DeviceState pid_state(const PidConstants& constants, const PidInput& input) noexcept;

enum class PidLoad { success, full, pending };

/// Block Load report: result for the effect just created.
struct PidBlockLoad {
  PidLoad load = PidLoad::pending;
  std::uint32_t block = 0;  ///< number of the effect, from 1
};

/// Decodes the result of hid_get_feature_report: the report id, then the report. Empty for another report or
/// a wrong length.
[[nodiscard]] std::optional<PidBlockLoad> decode_block_load(const PidLayout& layout,
                                                            std::span<const std::uint8_t> report) noexcept;

[[nodiscard]] PidReport encode_device_control(const HidOption& option) noexcept;
/// Encodes the feature report Create New Effect.
[[nodiscard]] PidReport encode_create_constant(const PidLayout& layout) noexcept;
/// Returns the feature report, with its id and length, to request by hid_get_feature_report.
[[nodiscard]] PidReport block_load_request(const PidLayout& layout) noexcept;
/// Encodes Set Effect: endless, at full gain, along a direction [degrees].
[[nodiscard]] PidReport encode_set_effect(const PidLayout& layout, std::uint32_t block,
                                          double direction) noexcept;
/// Encodes Set Constant Force. `part`: fraction of the largest magnitude, clamped to [-1, 1]; NaN becomes 0.
[[nodiscard]] PidReport encode_constant_force(const PidLayout& layout, std::uint32_t block,
                                              double part) noexcept;
/// Encodes Effect Operation. `option`: layout.start or layout.stop.
[[nodiscard]] PidReport encode_operation(const PidLayout& layout, std::uint32_t block,
                                         const HidOption& option) noexcept;

/// A force [N] as parts of the largest magnitudes, along x and y, saturated. z is not shown.
[[nodiscard]] std::array<double, pid_axes> pid_force(const PidConstants& constants,
                                                     const Vec3& force) noexcept;

}  // namespace palpate
