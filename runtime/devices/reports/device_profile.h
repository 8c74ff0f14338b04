// What Palpate knows of a device before it is opened: a text file that a user can copy and edit.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "runtime/devices/reports/hid_report_descriptor.h"
#include "runtime/devices/reports/pid_reports.h"
#include "runtime/devices/reports/space_mouse.h"
#include "runtime/devices/reports/woodenhaptics_arm.h"
#include "runtime/safety/device.h"

namespace palpate {

/// What an operating system says of an attached HID device.
struct DeviceId {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  HidUsage usage{};
  std::span<const HidUsage> collections{};  ///< HidReportDescriptor::collections
};

/// What a device must have; what is empty may be anything.
struct DeviceMatch {
  std::optional<std::uint16_t> vendor{};
  std::optional<std::uint16_t> product{};
  std::optional<HidUsage> usage{};
  std::optional<HidUsage> collection{};  ///< somewhere in its report descriptor

  [[nodiscard]] bool fits(const DeviceId& device) const noexcept;
};

/// Longest reports in bytes, with the report id where reports have one; 0: the descriptor says.
struct ReportLengths {
  int input = 0;
  int output = 0;
  int feature = 0;
};

/// A home-made board says all that there is to know.
struct BoardConstants {};

struct DeviceProfile {
  std::string name;
  std::vector<DeviceMatch> matches;  ///< any of them; at least one
  ReportLengths reports;
  DeviceLimits limits;
  std::variant<ArmConstants, SpaceMouseConstants, PidConstants, BoardConstants> kind;

  [[nodiscard]] bool fits(const DeviceId& device) const noexcept;
};

/// Reads a profile (TOML). Throws Error that names file, line and key, and says what to do.
[[nodiscard]] DeviceProfile read_device_profile(const std::filesystem::path& file);

/// Reads a profile from `text`; `name` stands for the file in messages.
[[nodiscard]] DeviceProfile parse_device_profile(std::string_view text, const std::string& name);

}  // namespace palpate
