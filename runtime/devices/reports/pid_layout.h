// Where a force-feedback joystick keeps what a constant force needs (USB Device Class Definition for Physical
// Interface Devices 1.0). Report ids differ from device to device: all is found by usage, none by id.
// Usages also in torvalds/linux, drivers/hid/usbhid/hid-pidff.c.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "runtime/devices/reports/hid_report_descriptor.h"

namespace palpate {

constexpr std::size_t pid_axes = 2;
constexpr std::size_t pid_report_room = 64;  ///< of a full-speed interrupt transfer, with the report id

struct PidLayout {
  bool numbered = false;

  std::array<HidElement, pid_axes> axes;              ///< input: x right, y to the user, in one report
  std::array<std::optional<HidElement>, 32> buttons;  ///< of the same report

  HidOption enable_actuators;  ///< output Device Control
  HidOption device_reset;

  HidOption create_constant;  ///< feature Create New Effect: a constant force

  HidElement load_block;  ///< feature Block Load: the new effect's number
  HidOption load_success;
  HidOption load_full;

  HidElement effect_block;  ///< output Set Effect
  HidOption effect_constant;
  HidElement effect_duration;
  HidElement effect_direction;  ///< one angle, where direction is enabled
  std::optional<HidElement> effect_direction_enable;
  std::optional<HidElement> effect_gain;

  HidElement constant_block;  ///< output Set Constant Force
  HidElement magnitude;

  HidElement operation_block;  ///< output Effect Operation
  HidOption start;
  HidOption stop;
  std::optional<HidElement> loop_count;
};

/// Throws Error that names `device` and the usage that its descriptor lacks.
[[nodiscard]] PidLayout find_pid_layout(const HidReportDescriptor& descriptor, const std::string& device);

}  // namespace palpate
