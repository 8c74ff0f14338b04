#include "runtime/devices/hid/hid_device.h"

#include <hidapi.h>

#include "base/error.h"

namespace palpate {

HidDevice::HidDevice(const std::string& path) : device_(hid_open_path(path.c_str())) {
  if (!device_) {
    throw Error("the device cannot be opened", path, "see what palpate-runtime devices says of it");
  }
}

void HidDevice::Close::operator()(hid_device_* device) const noexcept {
  hid_close(device);
}

int HidDevice::read(std::span<std::uint8_t> report, int wait) noexcept {
  return hid_read_timeout(device_.get(), report.data(), report.size(), wait);
}

bool HidDevice::write(std::span<const std::uint8_t> report) noexcept {
  return hid_write(device_.get(), report.data(), report.size()) == static_cast<int>(report.size());
}

bool HidDevice::set_feature(std::span<const std::uint8_t> report) noexcept {
  return hid_send_feature_report(device_.get(), report.data(), report.size()) >= 0;
}

int HidDevice::get_feature(std::span<std::uint8_t> report) noexcept {
  return hid_get_feature_report(device_.get(), report.data(), report.size());
}

}  // namespace palpate
