// Attached HID devices and their accessibility.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "runtime/devices/reports/device_profile.h"
#include "runtime/devices/reports/hid_report_descriptor.h"

namespace palpate {

/// Properties of a device that the operating system reports without opening it.
struct AttachedDevice {
  std::string path;  ///< e.g. /dev/hidraw0; changes when it is plugged in again
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::string serial;  ///< empty if it has none
  std::string maker;
  std::string product_name;
  std::vector<std::uint8_t> descriptor;  ///< report descriptor; empty if the system does not provide it
  HidReportDescriptor reports;           ///< the parsed descriptor; empty if it cannot be parsed
  std::string descriptor_problem;        ///< reason why it cannot be parsed; empty if it was
  int access = 0;                        ///< errno of opening it for reading and writing; 0: it can be opened

  /// Identity for profile matching; refers to this object.
  [[nodiscard]] DeviceId id() const { return {vendor, product, reports.usage, reports.collections}; }
  /// Name for messages: "1234:0006 Name (/dev/hidraw0)".
  [[nodiscard]] std::string name() const;
};

/// Returns all attached HID devices, sorted by path. `sys`: mount point of sysfs, since hidapi 0.13.1 has no
/// call for the report descriptor. Empty as well if there is neither udev nor sysfs.
[[nodiscard]] std::vector<AttachedDevice> attached_devices(const std::filesystem::path& sys = "/sys");

/// Reason why a device cannot be opened, with a hint.
struct AccessProblem {
  std::string what;
  std::string hint;
};
[[nodiscard]] AccessProblem access_problem(const AttachedDevice& device);

/// Returns the udev rule that gives the person at the machine access to a device, for a file in
/// /etc/udev/rules.d.
[[nodiscard]] std::string udev_rule(std::uint16_t vendor, std::uint16_t product);

/// Describes a report descriptor for people: a line for each field, then its bytes.
[[nodiscard]] std::string describe_reports(const AttachedDevice& device);

}  // namespace palpate
