// Protocol of a kind of HID device, without the connection, which HidPort has.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/devices/hid/hid_device.h"
#include "runtime/safety/device.h"

namespace palpate {

/// Output report as hid_write and a hidraw device take it: the report id (0 for unnumbered reports), then its
/// contents.
using OutputReport = std::vector<std::uint8_t>;

/// Output reports of one command, in order, in fixed memory.
class OutputReports {
 public:
  /// Appends a report. One that does not fit is dropped; the protocols have at most two reports per command,
  /// of at most 64 bytes.
  void add(std::span<const std::uint8_t> report) noexcept {
    if (count_ == most || report.size() > room) return;
    std::copy(report.begin(), report.end(), bytes_[count_].begin());
    sizes_[count_++] = report.size();
  }

  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  [[nodiscard]] std::span<const std::uint8_t> operator[](std::size_t k) const noexcept {
    return {bytes_[k].data(), sizes_[k]};
  }

 private:
  static constexpr std::size_t most = 2;
  static constexpr std::size_t room = 64;

  std::array<std::array<std::uint8_t, room>, most> bytes_{};
  std::array<std::size_t, most> sizes_{};
  std::size_t count_ = 0;
};

/// Protocol of one kind of device; a new object for each opening. `take` and `tell` belong to the reading
/// thread, `encode` to the writing thread.
class HidProtocol {
 public:
  explicit HidProtocol(const DeviceLimits& limits) : limits_(limits) {}
  virtual ~HidProtocol() = default;
  HidProtocol(const HidProtocol&) = delete;
  HidProtocol& operator=(const HidProtocol&) = delete;

  /// Length of the longest input report of interest, including the id if reports have one [byte].
  [[nodiscard]] virtual std::size_t input_bytes() const noexcept = 0;

  /// Waiting time for a report [ms].
  [[nodiscard]] virtual int wait() const noexcept { return 10; }

  /// Exchanges the reports that must precede states and forces. Throws Error.
  virtual void start(HidDevice& /*device*/) {}

  /// Decodes and stores an input report; false if it is invalid.
  virtual bool take(std::span<const std::uint8_t> report) noexcept = 0;

  /// Writes pose, buttons, velocity and sequence number at `now` [ns] to `state`. `heard`: a report was taken
  /// since the last call. False if there is no new state.
  virtual bool tell(bool heard, std::int64_t now, DeviceState& state) noexcept = 0;

  /// Encodes the reports that display `command` with the device at `state`.
  virtual void encode(const DeviceCommand& /*command*/, const DeviceState& /*state*/,
                      OutputReports& /*reports*/) noexcept {}

  /// Returns the reports after which there is no force, from any state; none for a device without force.
  [[nodiscard]] virtual std::vector<OutputReport> zero() const { return {}; }

  /// Limits of the profile, or the device's own where they are smaller, once it was started.
  [[nodiscard]] const DeviceLimits& limits() const noexcept { return limits_; }

 protected:
  DeviceLimits limits_;
};

}  // namespace palpate
