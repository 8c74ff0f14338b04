// HID protocol of a force-feedback joystick.
#pragma once

#include "runtime/devices/hid/hid_protocol.h"
#include "runtime/devices/reports/pid_sequence.h"
#include "runtime/safety/velocity_estimator.h"

namespace palpate {

/// Two constant effects play without end, so the last force continues if no new one is sent: such a device
/// needs the guardian most. A report equal to the one before is sent only every 0.1 s, as the bus carries one
/// per millisecond.
///
/// Many sticks report changes only, so one at rest is not faulty: its last report is repeated under a new
/// number until the next one arrives. A lost stick is detected by reads and writes that fail, a hung one by
/// frozen numbers while a force is displayed.
class HidJoystick : public HidProtocol {
 public:
  HidJoystick(const PidConstants& constants, const DeviceLimits& limits, const PidLayout& layout,
              std::string device, std::uint32_t last);

  [[nodiscard]] std::size_t input_bytes() const noexcept override;
  /// Waiting time, shorter than the silence from which the force fades [ms].
  [[nodiscard]] int wait() const noexcept override { return 3; }
  /// Runs the PID start sequence. Throws Error with the step that the device failed.
  void start(HidDevice& device) override;
  bool take(std::span<const std::uint8_t> report) noexcept override;
  /// False only before the first report. The sequence number advances by the milliseconds between two
  /// reports, so that no speed is computed from a repetition to a report.
  bool tell(bool heard, std::int64_t now, DeviceState& state) noexcept override;
  void encode(const DeviceCommand& command, const DeviceState& state,
              OutputReports& reports) noexcept override;
  /// Returns reports that set both forces to 0, stop both effects and reset the device.
  [[nodiscard]] std::vector<OutputReport> zero() const override;
  [[nodiscard]] DeviceLimits limits() const override { return limits_; }

 private:
  PidConstants constants_;
  DeviceLimits limits_;
  PidLayout layout_;
  std::string device_;
  std::uint32_t sequence_;
  PidSequence effects_;
  PidInput input_;
  VelocityEstimator velocity_;
  DeviceState state_;       // state returned last
  std::int64_t heard_ = 0;  // time of the last report; 0: none yet [ns]

  struct Sent {
    PidReport report;
    std::int64_t time = 0;  // [ns]
  };
  std::array<Sent, pid_axes> sent_;
};

}  // namespace palpate
