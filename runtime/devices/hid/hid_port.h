// A HID device behind the interface of the loop's threads.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "runtime/devices/hid/guardian.h"
#include "runtime/devices/hid/hid_choice.h"
#include "runtime/devices/hid/hid_protocol.h"
#include "runtime/safety/device_port.h"

namespace palpate {

/// Opens, reads, writes and closes a device of one of the kinds of HidProtocol.
///
/// The threads that read and write should block signals: hidapi takes an interrupted wait for an error, and
/// so does this. After its first failing write the port does not touch the device in `write` any more, and
/// after its first failing read not in `read`, until it was closed and opened again: see HidDevice.
class HidPort : public DevicePort {
 public:
  /// The device of `choice`, found again by vendor, product and serial number each time it is opened, as its
  /// path changes when it is plugged in again. `guardian`, which may be null, is told of each opening. `sys`:
  /// where sysfs is mounted.
  explicit HidPort(HidChoice choice, Guardian* guardian = nullptr, std::filesystem::path sys = "/sys");
  ~HidPort() override;
  HidPort(const HidPort&) = delete;
  HidPort& operator=(const HidPort&) = delete;

  void open() override;
  /// Drains what has come to the newest. Reports that make no sense are dropped and counted. While the
  /// device does not take a write for 20 ms, only what it really says is told.
  ReadResult read(DeviceState& state) noexcept override;
  bool write(const DeviceCommand& command, const DeviceState& state) noexcept override;
  /// Sends each report of no force twice.
  void close() noexcept override;
  [[nodiscard]] DeviceLimits limits() const override { return limits_; }
  /// Not while it is being opened.
  [[nodiscard]] std::string name() const override;

  [[nodiscard]] std::string refusals() const override;

  /// Reports that were dropped, since the port was made.
  [[nodiscard]] std::int64_t dropped() const noexcept { return dropped_; }

 private:
  [[nodiscard]] AttachedDevice find_again() const;

  HidChoice choice_;
  Guardian* guardian_;
  std::filesystem::path sys_;
  DeviceLimits limits_;
  std::unique_ptr<HidProtocol> protocol_;
  std::unique_ptr<HidDevice> device_;            // null: closed
  std::vector<OutputReport> zero_;               // after which there is no force
  std::uint32_t sequence_ = 0;                   // the last that was told
  bool read_failed_ = false;                     // of the thread that reads
  bool write_failed_ = false;                    // of the thread that writes
  std::atomic<std::int64_t> writing_since_ = 0;  // 0: not writing [ns]
  std::atomic<std::int64_t> dropped_ = 0;
};

}  // namespace palpate
