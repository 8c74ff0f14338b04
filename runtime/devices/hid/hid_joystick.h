// A force-feedback joystick on the wire.
#pragma once

#include "runtime/devices/hid/hid_protocol.h"
#include "runtime/devices/reports/pid_sequence.h"
#include "runtime/safety/velocity_estimator.h"

namespace palpate {

/// Two constant effects play without end, so that what was told last goes on when nobody tells anything: such
/// a device needs the guardian most. A report that equals the one before it is sent only each 0.1 s, as the
/// bus carries one a millisecond.
///
/// Many sticks report only what has changed. One that rests is not silent, so its last report is told again,
/// with a new number, until it speaks: that it is gone is seen by reads and writes that fail, and that it
/// hangs by numbers that are frozen while a force is shown.
class HidJoystick : public HidProtocol {
 public:
  HidJoystick(const PidConstants& constants, const DeviceLimits& limits, const PidLayout& layout,
              std::string device, std::uint32_t last);

  [[nodiscard]] std::size_t input_bytes() const noexcept override;
  /// Shorter than a silence from which the force fades.
  [[nodiscard]] int wait() const noexcept override { return 3; }
  /// PID's conversation. Throws Error that says what the device did not do.
  void start(HidDevice& device) override;
  bool take(std::span<const std::uint8_t> report) noexcept override;
  /// False only before the first report. A report's number is ahead of the last one's by the milliseconds
  /// between, as a speed must not be measured from a repetition to it.
  bool tell(bool heard, std::int64_t now, DeviceState& state) noexcept override;
  void encode(const DeviceCommand& command, const DeviceState& state,
              OutputReports& reports) noexcept override;
  /// Forces of 0, both effects stopped, and the device reset.
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
  DeviceState state_;       // told last
  std::int64_t heard_ = 0;  // when; 0: not yet [ns]

  struct Sent {
    PidReport report;
    std::int64_t time = 0;  // [ns]
  };
  std::array<Sent, pid_axes> sent_;
};

}  // namespace palpate
