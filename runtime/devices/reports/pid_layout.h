// Location of the numbers that a constant force needs in the reports of a force-feedback joystick (USB Device
// Class Definition for Physical Interface Devices 1.0). Report ids differ between devices, so all are found
// by usage. The usages are also in torvalds/linux, drivers/hid/usbhid/hid-pidff.c.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "runtime/devices/reports/hid_report_descriptor.h"

namespace palpate {

constexpr std::size_t pid_axes = 2;
constexpr std::size_t pid_report_room = 64;  ///< full-speed interrupt transfer, with the report id [byte]

struct PidLayout {
  bool numbered = false;

  std::array<HidElement, pid_axes> axes;              ///< input: x right, y towards the user, in one report
  std::array<std::optional<HidElement>, 32> buttons;  ///< input: buttons of the same report

  HidOption enable_actuators;  ///< output Device Control
  HidOption device_reset;

  HidOption create_constant;  ///< feature Create New Effect: a constant force

  HidElement load_block;  ///< feature Block Load: number of the new effect
  HidOption load_success;
  HidOption load_full;

  HidElement effect_block;  ///< output Set Effect
  HidOption effect_constant;
  HidElement effect_duration;
  HidElement effect_direction;  ///< a single angle, if direction is enabled
  std::optional<HidElement> effect_direction_enable;
  std::optional<HidElement> effect_gain;

  HidElement constant_block;  ///< output Set Constant Force
  HidElement magnitude;

  HidElement operation_block;  ///< output Effect Operation
  HidOption start;
  HidOption stop;
  std::optional<HidElement> loop_count;
};

/// Finds all elements. Throws Error that names `device` and the usage missing from its descriptor.
[[nodiscard]] PidLayout find_pid_layout(const HidReportDescriptor& descriptor, const std::string& device);

}  // namespace palpate
