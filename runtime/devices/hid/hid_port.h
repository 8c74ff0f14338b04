// HID device as a DevicePort.
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

/// Opens, reads, writes and closes a device by one of the HidProtocols.
///
/// The threads that read and write should block signals: hidapi treats an interrupted wait as an error, and
/// so does this. After the first failing write, `write` no longer touches the device, and after the first
/// failing read, `read` does not, until the port is closed and opened again: see HidDevice.
class HidPort : public DevicePort {
 public:
  /// Uses the device of `choice`, found again by vendor, product and serial number at each opening, as its
  /// path changes when it is plugged in again. `guardian`, which may be null, is notified of each opening.
  /// `sys`: mount point of sysfs.
  explicit HidPort(HidChoice choice, Guardian* guardian = nullptr, std::filesystem::path sys = "/sys");
  ~HidPort() override;
  HidPort(const HidPort&) = delete;
  HidPort& operator=(const HidPort&) = delete;

  void open() override;
  /// Drains the pending reports and keeps the newest. Invalid reports are dropped and counted. If a write has
  /// been blocked for 20 ms, only actual reports count, not repetitions.
  ReadResult read(DeviceState& state) noexcept override;
  bool write(const DeviceCommand& command, const DeviceState& state) noexcept override;
  /// Sends each report for zero force twice, then closes.
  void close() noexcept override;
  [[nodiscard]] DeviceLimits limits() const override { return limits_; }
  /// Must not be called while the device is being opened.
  [[nodiscard]] std::string name() const override;

  [[nodiscard]] std::string refusals() const override;

  /// Number of reports dropped since the port was made.
  [[nodiscard]] std::int64_t dropped() const noexcept { return dropped_; }

 private:
  [[nodiscard]] AttachedDevice find_again() const;

  HidChoice choice_;
  Guardian* guardian_;
  std::filesystem::path sys_;
  DeviceLimits limits_;
  std::unique_ptr<HidProtocol> protocol_;
  std::unique_ptr<HidDevice> device_;            // null if closed
  std::vector<OutputReport> zero_;               // reports for zero force
  std::uint32_t sequence_ = 0;                   // sequence number of the last state
  bool read_failed_ = false;                     // used by the reading thread
  bool write_failed_ = false;                    // used by the writing thread
  std::atomic<std::int64_t> writing_since_ = 0;  // 0: not writing [ns]
  std::atomic<std::int64_t> dropped_ = 0;
};

}  // namespace palpate
