// Open HID device, through hidapi.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

struct hid_device_;  // declared by hidapi

namespace palpate {

/// Owner of hidapi's device. One thread may read while another one writes; all other calls are for one
/// thread.
///
/// hidapi keeps the text of the last error in the device without a lock (0.13.1): each call frees the
/// previous text. After an error a thread must therefore not touch the device until the other thread has
/// stopped, and the text must not be queried in the meantime.
class HidDevice {
 public:
  /// Throws Error if `path` cannot be opened.
  explicit HidDevice(const std::string& path);

  /// Waits at most `wait` ms for a report. Returns its size in bytes, 0 if there was none, -1 on an error,
  /// such as an unplugged device.
  [[nodiscard]] int read(std::span<std::uint8_t> report, int wait) noexcept;

  /// Sends an output report: its id (0 for unnumbered reports), then its contents. False on an error.
  [[nodiscard]] bool write(std::span<const std::uint8_t> report) noexcept;

  /// Sends a feature report, id first. False on an error.
  [[nodiscard]] bool set_feature(std::span<const std::uint8_t> report) noexcept;

  /// Reads the feature report with id report[0]. Returns its size in bytes including the id, -1 on an error.
  [[nodiscard]] int get_feature(std::span<std::uint8_t> report) noexcept;

 private:
  struct Close {
    void operator()(hid_device_* device) const noexcept;
  };
  std::unique_ptr<hid_device_, Close> device_;
};

}  // namespace palpate
