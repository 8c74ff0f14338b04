#include "runtime/devices/reports/pid_layout.h"

#include <array>
#include <cstdio>
#include <vector>

#include "base/error.h"

namespace palpate {
namespace {

using enum HidReportType;

constexpr HidUsage desktop(std::uint16_t id) {
  return {0x01, id};
}
constexpr HidUsage button(std::uint16_t id) {
  return {0x09, id};
}
constexpr HidUsage pid(std::uint16_t id) {
  return {0x0F, id};
}

constexpr HidUsage axis_x = desktop(0x30);
constexpr HidUsage axis_y = desktop(0x31);
constexpr HidUsage set_effect = pid(0x21);
constexpr HidUsage effect_block_index = pid(0x22);
constexpr HidUsage constant_force = pid(0x26);
constexpr HidUsage duration = pid(0x50);
constexpr HidUsage gain = pid(0x52);
constexpr HidUsage direction_enable = pid(0x56);
constexpr HidUsage direction = pid(0x57);
constexpr HidUsage magnitude = pid(0x70);
constexpr HidUsage set_constant_force = pid(0x73);
constexpr HidUsage effect_operation = pid(0x77);
constexpr HidUsage start = pid(0x79);
constexpr HidUsage stop = pid(0x7B);
constexpr HidUsage loop_count = pid(0x7C);
constexpr HidUsage block_load = pid(0x89);
constexpr HidUsage load_success = pid(0x8C);
constexpr HidUsage load_full = pid(0x8D);
constexpr HidUsage enable_actuators = pid(0x97);
constexpr HidUsage device_reset = pid(0x9A);
constexpr HidUsage create_new_effect = pid(0xAB);

class Finder {
 public:
  Finder(const HidReportDescriptor& descriptor, const std::string& device)
      : descriptor_(descriptor), device_(device) {}

  [[nodiscard]] HidElement element(HidReportType type, const std::vector<HidUsage>& within, HidUsage usage,
                                   const char* name) const {
    return checked(descriptor_.element(type, within, usage), usage, name);
  }

  [[nodiscard]] HidOption option(HidReportType type, const std::vector<HidUsage>& within, HidUsage usage,
                                 const char* name) const {
    const auto found = descriptor_.option(type, within, usage);
    if (!found) lacks(usage, name);
    fits(found->element, name);
    return *found;
  }

  [[nodiscard]] HidElement first(HidReportType type, const std::vector<HidUsage>& within, HidUsage usage,
                                 const char* name) const {
    return checked(descriptor_.first_element(type, within), usage, name);
  }

  /// Finds an optional element in the report of `other`.
  [[nodiscard]] std::optional<HidElement> beside(const HidElement& other, const std::vector<HidUsage>& within,
                                                 HidUsage usage) const {
    auto found = descriptor_.element(other.type, within, usage);
    if (found && found->report_id != other.report_id) found.reset();
    return found;
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(what, device_, "it can be read as a joystick, but shows no constant forces by USB PID");
  }

  /// Checks that two elements are in the same report.
  void together(const HidElement& a, const HidElement& b, const char* name) const {
    if (a.report_id != b.report_id) fail(std::string(name) + " is not in one report");
  }

 private:
  [[nodiscard]] HidElement checked(const std::optional<HidElement>& found, HidUsage usage,
                                   const char* name) const {
    if (!found) lacks(usage, name);
    fits(*found, name);
    return *found;
  }

  void fits(const HidElement& element, const char* name) const {
    if (element.report_bytes + std::size_t{1} > pid_report_room) {
      fail(std::string("the report with ") + name + " has " + std::to_string(element.report_bytes) +
           " bytes");
    }
  }

  [[noreturn]] void lacks(HidUsage usage, const char* name) const {
    std::array<char, 16> text{};
    std::snprintf(text.data(), text.size(), "%04X:%04X", usage.page, usage.id);
    fail(std::string("its report descriptor lacks ") + name + " (usage " + text.data() + ")");
  }

  const HidReportDescriptor& descriptor_;
  const std::string& device_;
};

}  // namespace

PidLayout find_pid_layout(const HidReportDescriptor& descriptor, const std::string& device) {
  const Finder find(descriptor, device);
  PidLayout layout;
  layout.numbered = descriptor.numbered;

  layout.axes = {find.element(input, {}, axis_x, "an X axis"), find.element(input, {}, axis_y, "a Y axis")};
  find.together(layout.axes[0], layout.axes[1], "its position");
  for (std::size_t k = 0; k < layout.buttons.size(); ++k) {
    layout.buttons[k] = find.beside(layout.axes[0], {}, button(static_cast<std::uint16_t>(k + 1)));
  }

  layout.enable_actuators = find.option(output, {}, enable_actuators, "DC Enable Actuators");
  layout.device_reset = find.option(output, {}, device_reset, "DC Device Reset");

  layout.create_constant =
      find.option(feature, {create_new_effect}, constant_force, "ET Constant Force in Create New Effect");

  layout.load_block =
      find.element(feature, {block_load}, effect_block_index, "Effect Block Index in Block Load");
  layout.load_success = find.option(feature, {block_load}, load_success, "Block Load Success");
  layout.load_full = find.option(feature, {block_load}, load_full, "Block Load Full");
  find.together(layout.load_block, layout.load_success.element, "Block Load");
  find.together(layout.load_block, layout.load_full.element, "Block Load");

  layout.effect_block =
      find.element(output, {set_effect}, effect_block_index, "Effect Block Index in Set Effect");
  layout.effect_constant =
      find.option(output, {set_effect}, constant_force, "ET Constant Force in Set Effect");
  layout.effect_duration = find.element(output, {set_effect}, duration, "Duration in Set Effect");
  layout.effect_direction = find.first(output, {set_effect, direction}, direction, "Direction in Set Effect");
  layout.effect_direction_enable = find.beside(layout.effect_block, {set_effect}, direction_enable);
  layout.effect_gain = find.beside(layout.effect_block, {set_effect}, gain);
  find.together(layout.effect_block, layout.effect_constant.element, "Set Effect");
  find.together(layout.effect_block, layout.effect_duration, "Set Effect");
  find.together(layout.effect_block, layout.effect_direction, "Set Effect");

  layout.constant_block = find.element(output, {set_constant_force}, effect_block_index,
                                       "Effect Block Index in Set Constant Force");
  layout.magnitude = find.element(output, {set_constant_force}, magnitude, "Magnitude in Set Constant Force");
  find.together(layout.constant_block, layout.magnitude, "Set Constant Force");
  if (layout.magnitude.logical_min >= 0 || layout.magnitude.logical_max <= 0) {
    find.fail("its constant force has one sign only: " + std::to_string(layout.magnitude.logical_min) +
              " to " + std::to_string(layout.magnitude.logical_max));
  }

  layout.operation_block =
      find.element(output, {effect_operation}, effect_block_index, "Effect Block Index in Effect Operation");
  layout.start = find.option(output, {effect_operation}, start, "Op Effect Start");
  layout.stop = find.option(output, {effect_operation}, stop, "Op Effect Stop");
  layout.loop_count = find.beside(layout.operation_block, {effect_operation}, loop_count);
  find.together(layout.operation_block, layout.start.element, "Effect Operation");
  find.together(layout.operation_block, layout.stop.element, "Effect Operation");
  return layout;
}

}  // namespace palpate
