// An open HID device, through hidapi.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

struct hid_device_;  // hidapi's

namespace palpate {

/// Owns hidapi's device. One thread may read while another one writes; everything else is for one thread.
///
/// hidapi keeps the text of the last error in the device, without a lock (0.13.1): each call frees what the
/// last one left. Therefore a thread that was told of an error must not touch the device again until the
/// other one has stopped, and nobody asks for the text meanwhile.
class HidDevice {
 public:
  /// Throws Error when `path` cannot be opened.
  explicit HidDevice(const std::string& path);

  /// Waits for a report for at most `wait` ms. How many bytes it has, 0 when there was none, -1 on an error,
  /// which an unplugged device is.
  [[nodiscard]] int read(std::span<std::uint8_t> report, int wait) noexcept;

  /// Sends an output report: its id, 0 where reports have none, then what is in it.
  [[nodiscard]] bool write(std::span<const std::uint8_t> report) noexcept;

  /// Sends a feature report, id first.
  [[nodiscard]] bool set_feature(std::span<const std::uint8_t> report) noexcept;

  /// Asks for the feature report whose id report[0] is. How many bytes it has, with its id; -1 on an error.
  [[nodiscard]] int get_feature(std::span<std::uint8_t> report) noexcept;

 private:
  struct Close {
    void operator()(hid_device_* device) const noexcept;
  };
  std::unique_ptr<hid_device_, Close> device_;
};

}  // namespace palpate
