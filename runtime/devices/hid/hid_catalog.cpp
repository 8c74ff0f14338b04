#include "runtime/devices/hid/hid_catalog.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <hidapi.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "base/error.h"
#include "base/printable.h"

namespace palpate {
namespace {

/// Converts hidapi's wide characters, which are Unicode on Linux, to UTF-8.
std::string utf8(const wchar_t* text) {
  std::string result;
  for (; text != nullptr && *text != L'\0'; ++text) {
    const auto code = static_cast<char32_t>(*text);
    const auto put = [&](char32_t byte) { result += static_cast<char>(byte); };
    if (code < 0x80) {
      put(code);
    } else if (code < 0x800) {
      put(0xC0U | code >> 6U);
      put(0x80U | (code & 0x3FU));
    } else if (code < 0x10000) {
      put(0xE0U | code >> 12U);
      put(0x80U | (code >> 6U & 0x3FU));
      put(0x80U | (code & 0x3FU));
    } else {
      put(0xF0U | code >> 18U);
      put(0x80U | (code >> 12U & 0x3FU));
      put(0x80U | (code >> 6U & 0x3FU));
      put(0x80U | (code & 0x3FU));
    }
  }
  return result;
}

/// Opens the device briefly, which moves nothing, and returns errno; 0 if it could be opened.
int access_of(const std::string& path) {
  const int file = open(path.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return errno;
  close(file);
  return 0;
}

void read_descriptor(AttachedDevice& device, const std::filesystem::path& sys) {
  const std::filesystem::path file =
      sys / "class" / "hidraw" / std::filesystem::path(device.path).filename() / "device/report_descriptor";
  std::ifstream stream(file, std::ios::binary);
  device.descriptor.assign(std::istreambuf_iterator<char>(stream), {});
  if (device.descriptor.empty()) {
    device.descriptor_problem = file.string() + " cannot be read";
    return;
  }
  try {
    device.reports = parse_report_descriptor(device.descriptor, device.path);
  } catch (const Error& error) {
    device.descriptor_problem = error.what();
  }
}

std::string usage_text(HidUsage usage) {
  return fmt::format("{:04X}:{:02X}", usage.page, usage.id);
}

}  // namespace

std::string AttachedDevice::name() const {
  return fmt::format("{:04X}:{:04X}{}{} ({})", vendor, product, product_name.empty() ? "" : " ",
                     printable(product_name), path);
}

std::vector<AttachedDevice> attached_devices(const std::filesystem::path& sys) {
  std::vector<AttachedDevice> result;
  hid_device_info* const all = hid_enumerate(0, 0);
  for (const hid_device_info* info = all; info != nullptr; info = info->next) {
    const std::string path = info->path == nullptr ? "" : info->path;
    // A device with several application collections is listed once per collection.
    if (path.empty() ||
        std::ranges::any_of(result, [&](const AttachedDevice& device) { return device.path == path; })) {
      continue;
    }
    AttachedDevice device;
    device.path = path;
    device.vendor = info->vendor_id;
    device.product = info->product_id;
    device.serial = utf8(info->serial_number);
    device.maker = utf8(info->manufacturer_string);
    device.product_name = utf8(info->product_string);
    read_descriptor(device, sys);
    device.access = access_of(path);
    result.push_back(std::move(device));
  }
  hid_free_enumeration(all);
  std::ranges::sort(result, {}, &AttachedDevice::path);
  return result;
}

AccessProblem access_problem(const AttachedDevice& device) {
  if (device.access == EACCES) {
    return {"you may not open it",
            fmt::format("put the line\n    {}\ninto /etc/udev/rules.d/70-palpate.rules, then\n    sudo "
                        "udevadm control --reload && sudo udevadm trigger",
                        udev_rule(device.vendor, device.product))};
  }
  if (device.access == EPERM) {
    return {"this container or sandbox may not open it",
            fmt::format("give it the device, such as docker run --device {}", device.path)};
  }
  if (device.access == EBUSY) return {"another program has it", "close that program"};
  if (device.access == ENOENT) {
    return {"the system knows it, but its node is not there",
            fmt::format("in a container: give it the device, such as docker run --device {}; else plug it in "
                        "again",
                        device.path)};
  }
  return {fmt::format("it cannot be opened: {}", std::strerror(device.access)), "plug it in again"};
}

std::string udev_rule(std::uint16_t vendor, std::uint16_t product) {
  return fmt::format(
      R"(KERNEL=="hidraw*", ATTRS{{idVendor}}=="{:04x}", ATTRS{{idProduct}}=="{:04x}", TAG+="uaccess")",
      vendor, product);
}

std::string describe_reports(const AttachedDevice& device) {
  constexpr std::array types = {"input", "output", "feature"};
  constexpr std::size_t most_usages = 6;
  constexpr std::size_t bytes_a_line = 32;
  std::string text;
  if (!device.descriptor_problem.empty()) text += fmt::format("  {}\n", device.descriptor_problem);
  for (const HidField& field : device.reports.fields) {
    text += fmt::format("  {} report {}: {} x {} bit from bit {}, {} to {}, usage",
                        types[static_cast<std::size_t>(field.type)], field.report_id, field.count, field.bits,
                        field.bit, field.logical_min, field.logical_max);
    for (std::size_t k = 0; k < std::min(field.usages.size(), most_usages); ++k) {
      text += " " + usage_text(field.usages[k]);
    }
    if (field.usages.size() > most_usages)
      text += fmt::format(" and {} more", field.usages.size() - most_usages);
    text += "\n";
  }
  for (std::size_t k = 0; k < device.descriptor.size(); ++k) {
    text +=
        fmt::format("{}{:02x}", k % bytes_a_line == 0 ? (k == 0 ? "  " : "\n  ") : " ", device.descriptor[k]);
  }
  return text;
}

}  // namespace palpate
