#include "runtime/devices/reports/pid_reports.h"

#include <algorithm>
#include <cmath>

#include "runtime/safety/saturation.h"

namespace palpate {
namespace {

constexpr double full_turn = 360.0;  // degrees

/// Returns the report of the element, filled with zeros.
PidReport report_of(const HidElement& element) noexcept {
  PidReport report;
  report.bytes[0] = element.report_id;
  report.size = 1 + std::size_t{element.report_bytes};
  return report;
}

void put(PidReport& report, const HidElement& element, std::int64_t value) noexcept {
  write_element(element, value, {report.bytes.data() + 1, pid_report_room - 1});
}

void put(PidReport& report, const HidOption& option) noexcept {
  put(report, option.element, option.value);
}

bool is(const HidOption& option, std::span<const std::uint8_t> report) noexcept {
  return read_element(option.element, report) == option.value;
}

}  // namespace

std::optional<PidInput> decode_pid_input(const PidLayout& layout,
                                         std::span<const std::uint8_t> report) noexcept {
  const HidElement& x = layout.axes[0];
  if (layout.numbered) {
    if (report.empty() || report[0] != x.report_id) return std::nullopt;
    report = report.subspan(1);
  }
  if (report.size() != x.report_bytes) return std::nullopt;
  PidInput input;
  for (std::size_t k = 0; k < pid_axes; ++k) {
    const HidElement& axis = layout.axes[k];
    const std::int64_t value = read_element(axis, report);
    if (value < axis.logical_min || value > axis.logical_max) return std::nullopt;
    const auto range = static_cast<double>(axis.logical_max - axis.logical_min);
    if (range > 0.0) input.axes[k] = 2.0 * static_cast<double>(value - axis.logical_min) / range - 1.0;
  }
  input.axes[1] = -input.axes[1];  // HID's y points towards the user
  for (std::size_t k = 0; k < layout.buttons.size(); ++k) {
    if (layout.buttons[k] && read_element(*layout.buttons[k], report) != 0) input.buttons |= 1U << k;
  }
  return input;
}

DeviceState pid_state(const PidConstants& constants, const PidInput& input) noexcept {
  DeviceState state;
  state.pose.position = {constants.half_travel[0] * input.axes[0], constants.half_travel[1] * input.axes[1],
                         0.0};
  state.buttons = input.buttons;
  state.pose.grab = (input.buttons & 1U) != 0;
  return state;
}

std::optional<PidBlockLoad> decode_block_load(const PidLayout& layout,
                                              std::span<const std::uint8_t> report) noexcept {
  const HidElement& block = layout.load_block;
  if (report.size() != 1 + std::size_t{block.report_bytes} || report[0] != block.report_id)
    return std::nullopt;
  report = report.subspan(1);
  PidBlockLoad result;
  if (is(layout.load_full, report)) {
    result.load = PidLoad::full;
  } else if (is(layout.load_success, report)) {
    const std::int64_t number = read_element(block, report);
    if (number < 1 || number > block.logical_max) return std::nullopt;
    result = {PidLoad::success, static_cast<std::uint32_t>(number)};
  }
  return result;
}

PidReport encode_device_control(const HidOption& option) noexcept {
  PidReport report = report_of(option.element);
  put(report, option);
  return report;
}

PidReport encode_create_constant(const PidLayout& layout) noexcept {
  return encode_device_control(layout.create_constant);
}

PidReport block_load_request(const PidLayout& layout) noexcept {
  return report_of(layout.load_block);
}

PidReport encode_set_effect(const PidLayout& layout, std::uint32_t block, double direction) noexcept {
  PidReport report = report_of(layout.effect_block);
  put(report, layout.effect_block, block);
  put(report, layout.effect_constant);
  put(report, layout.effect_duration, -1);  // all ones: without end
  const HidElement& angle = layout.effect_direction;
  const double part = direction / full_turn - std::floor(direction / full_turn);
  put(report, angle,
      angle.logical_min + std::llround(part * static_cast<double>(angle.logical_max - angle.logical_min)));
  if (layout.effect_direction_enable) put(report, *layout.effect_direction_enable, 1);
  if (layout.effect_gain) put(report, *layout.effect_gain, layout.effect_gain->logical_max);
  return report;
}

PidReport encode_constant_force(const PidLayout& layout, std::uint32_t block, double part) noexcept {
  PidReport report = report_of(layout.constant_block);
  put(report, layout.constant_block, block);
  const double within = std::isfinite(part) ? std::clamp(part, -1.0, 1.0) : 0.0;
  const std::int64_t largest = within < 0.0 ? -layout.magnitude.logical_min : layout.magnitude.logical_max;
  put(report, layout.magnitude, std::llround(within * static_cast<double>(largest)));
  return report;
}

PidReport encode_operation(const PidLayout& layout, std::uint32_t block, const HidOption& option) noexcept {
  PidReport report = report_of(layout.operation_block);
  put(report, layout.operation_block, block);
  put(report, option);
  if (layout.loop_count) put(report, *layout.loop_count, layout.loop_count->logical_max);  // 255: without end
  return report;
}

std::array<double, pid_axes> pid_force(const PidConstants& constants, const Vec3& force) noexcept {
  const Vec3 parts =
      saturate({force.x() / constants.full_force[0], force.y() / constants.full_force[1], 0.0}, 1.0);
  return {parts.x(), parts.y()};
}

}  // namespace palpate
