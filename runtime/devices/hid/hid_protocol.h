// What a kind of HID device says and expects; HidPort has the wire.
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

/// An output report as hid_write and a hidraw device take it: the report id, 0 where reports have none, then
/// what is in it.
using OutputReport = std::vector<std::uint8_t>;

/// Output reports of one command, in order, without the heap.
class OutputReports {
 public:
  /// One that does not fit is left out; the kinds below have reports of at most 64 bytes, and two a command.
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

/// One for each time that a device is opened. `take` and `tell` belong to the thread that reads, `encode` to
/// the one that writes.
class HidProtocol {
 public:
  virtual ~HidProtocol() = default;

  /// The longest input report that is of interest, with its id where reports have one.
  [[nodiscard]] virtual std::size_t input_bytes() const noexcept = 0;

  /// How long to wait for a report [ms].
  [[nodiscard]] virtual int wait() const noexcept { return 10; }

  /// What must be said and asked before reports and forces flow. Throws Error.
  virtual void start(HidDevice& device) = 0;

  /// Takes note of an input report; false where it makes no sense.
  virtual bool take(std::span<const std::uint8_t> report) noexcept = 0;

  /// Fills pose, buttons, velocity and sequence at `now` [ns] from what was taken; `heard`: something was,
  /// since the last call. False when there is nothing new to tell.
  virtual bool tell(bool heard, std::int64_t now, DeviceState& state) noexcept = 0;

  /// The reports that show `command` with the device at `state`.
  virtual void encode(const DeviceCommand& command, const DeviceState& state,
                      OutputReports& reports) noexcept = 0;

  /// The reports after which there is no force, from any state; none where the device shows none.
  [[nodiscard]] virtual std::vector<OutputReport> zero() const = 0;

  [[nodiscard]] virtual DeviceLimits limits() const = 0;
};

}  // namespace palpate
