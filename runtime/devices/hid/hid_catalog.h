// HID devices that are attached, and whether they can be opened.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "runtime/devices/reports/device_profile.h"
#include "runtime/devices/reports/hid_report_descriptor.h"

namespace palpate {

/// What the operating system says of a device that is not open.
struct AttachedDevice {
  std::string path;  ///< such as /dev/hidraw0; another one after it was plugged in again
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::string serial;  ///< empty: it has none
  std::string maker;
  std::string product_name;
  std::vector<std::uint8_t> descriptor;  ///< its report descriptor; empty where the system does not show it
  HidReportDescriptor reports;           ///< the same, read; empty where it cannot be read
  std::string descriptor_problem;        ///< why; empty: it was read
  int access = 0;                        ///< errno of opening it to read and write; 0: it can be opened

  /// Points into this.
  [[nodiscard]] DeviceId id() const { return {vendor, product, reports.usage, reports.collections}; }
  /// "1234:0006 Name (/dev/hidraw0)".
  [[nodiscard]] std::string name() const;
};

/// All of them, by path. `sys` is where sysfs is mounted: hidapi 0.13.1 has no call for the report
/// descriptor. Empty where there is no udev and no sysfs, too.
[[nodiscard]] std::vector<AttachedDevice> attached_devices(const std::filesystem::path& sys = "/sys");

/// Why a device cannot be opened, and what to do about it.
struct AccessProblem {
  std::string what;
  std::string hint;
};
[[nodiscard]] AccessProblem access_problem(const AttachedDevice& device);

/// The rule that gives the person at the machine access to a device, for a file in /etc/udev/rules.d.
[[nodiscard]] std::string udev_rule(std::uint16_t vendor, std::uint16_t product);

/// A report descriptor for people: a line for each field, then its bytes.
[[nodiscard]] std::string describe_reports(const AttachedDevice& device);

}  // namespace palpate
