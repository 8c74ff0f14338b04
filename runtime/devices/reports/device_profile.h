// Profile of a device, known before it is opened: a text file that users can copy and edit.
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

/// Identity of an attached HID device, as the operating system reports it.
struct DeviceId {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  HidUsage usage{};
  std::span<const HidUsage> collections{};  ///< HidReportDescriptor::collections
};

/// Properties that a device must have; an empty one matches any device.
struct DeviceMatch {
  std::optional<std::uint16_t> vendor{};
  std::optional<std::uint16_t> product{};
  std::optional<HidUsage> usage{};
  std::optional<HidUsage> collection{};  ///< any collection of its report descriptor

  [[nodiscard]] bool fits(const DeviceId& device) const noexcept;
};

/// Longest reports [byte], including the report id if reports have one; 0: taken from the descriptor.
struct ReportLengths {
  int input = 0;
  int output = 0;
  int feature = 0;
};

/// Empty: a home-made board states all its constants itself.
struct BoardConstants {};

struct DeviceProfile {
  std::string name;
  std::vector<DeviceMatch> matches;  ///< alternatives, at least one
  ReportLengths reports;
  DeviceLimits limits;
  std::variant<ArmConstants, SpaceMouseConstants, PidConstants, BoardConstants> kind;

  [[nodiscard]] bool fits(const DeviceId& device) const noexcept;
};

/// Reads a profile (TOML). Throws Error that names file, line and key, with a hint.
[[nodiscard]] DeviceProfile read_device_profile(const std::filesystem::path& file);

/// Parses a profile from `text`; `name` stands for the file in messages.
[[nodiscard]] DeviceProfile parse_device_profile(std::string_view text, const std::string& name);

}  // namespace palpate
