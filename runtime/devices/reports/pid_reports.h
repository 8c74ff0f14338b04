// Reports of a force-feedback joystick, by its layout.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "meshes/mesh.h"
#include "runtime/devices/reports/pid_layout.h"
#include "runtime/safety/device.h"

namespace palpate {

/// As hidapi writes it: the report id (0 where reports have none), then the report.
struct PidReport {
  std::array<std::uint8_t, pid_report_room> bytes{};
  std::size_t size = 0;

  [[nodiscard]] std::span<const std::uint8_t> span() const noexcept { return {bytes.data(), size}; }
};

/// What no descriptor says and a user has to measure.
struct PidConstants {
  std::array<double, pid_axes> half_travel{};  ///< of the handle from the middle to the stop, x and y [m]
  std::array<double, pid_axes> full_force{};   ///< of the handle at the largest magnitude [N]
  /// Direction of the effect whose positive magnitude is a force along +x (right) and +y (from the user)
  /// [degrees]: by Linux, which follows PID, 0 pulls to the user, 90 to the left.
  std::array<double, pid_axes> directions{270.0, 180.0};
};

/// Where the handle is.
struct PidInput {
  std::array<double, pid_axes> axes{};  ///< right and from the user, -1 to 1 from stop to stop
  std::uint32_t buttons = 0;            ///< bit k: button k is down
};

/// Decodes what hidapi reads. Empty for another report, another length and an axis outside its logical range.
[[nodiscard]] std::optional<PidInput> decode_pid_input(const PidLayout& layout,
                                                       std::span<const std::uint8_t> report) noexcept;

/// In the plane z = 0 [m]; without velocity, time and number.
[[nodiscard]] DeviceState pid_state(const PidConstants& constants, const PidInput& input) noexcept;

enum class PidLoad { success, full, pending };

/// What Block Load says of the effect just created.
struct PidBlockLoad {
  PidLoad load = PidLoad::pending;
  std::uint32_t block = 0;  ///< its number, from 1
};

/// Decodes what hid_get_feature_report gives: the report id, then the report. Empty for another report or
/// length.
[[nodiscard]] std::optional<PidBlockLoad> decode_block_load(const PidLayout& layout,
                                                            std::span<const std::uint8_t> report) noexcept;

[[nodiscard]] PidReport encode_device_control(const HidOption& option) noexcept;
/// Feature.
[[nodiscard]] PidReport encode_create_constant(const PidLayout& layout) noexcept;
/// Feature: what to ask hid_get_feature_report for.
[[nodiscard]] PidReport block_load_request(const PidLayout& layout) noexcept;
/// Without end, at full gain, along a direction [degrees].
[[nodiscard]] PidReport encode_set_effect(const PidLayout& layout, std::uint32_t block,
                                          double direction) noexcept;
/// A part of the largest magnitude, from -1 to 1; more is cut off, and what is no number is 0.
[[nodiscard]] PidReport encode_constant_force(const PidLayout& layout, std::uint32_t block,
                                              double part) noexcept;
/// `option`: layout.start or layout.stop.
[[nodiscard]] PidReport encode_operation(const PidLayout& layout, std::uint32_t block,
                                         const HidOption& option) noexcept;

/// Parts of the largest magnitudes, x and y, and what is shown of the force [N]. z is not.
struct PidForce {
  std::array<double, pid_axes> parts{};
  double shown = 1.0;  ///< as in Saturated, of what lies in the plane
};
[[nodiscard]] PidForce pid_force(const PidConstants& constants, const Vec3& force) noexcept;

}  // namespace palpate
