// A force-feedback joystick on the wire.
#pragma once

#include "runtime/devices/hid_protocol.h"
#include "runtime/devices/pid_sequence.h"
#include "runtime/devices/velocity_estimator.h"

namespace palpate {

/// Two constant effects play without end, so that what was told last goes on when nobody tells anything: such
/// a device needs the guardian most. A report that equals the one before it is sent only each 0.1 s, as the
/// bus carries one a millisecond.
class HidJoystick : public HidProtocol {
 public:
  HidJoystick(const PidConstants& constants, const DeviceLimits& limits, const PidLayout& layout,
              std::string device, std::uint32_t last);

  [[nodiscard]] std::size_t input_bytes() const noexcept override;
  /// PID's conversation. Throws Error that says what the device did not do.
  void start(HidDevice& device) override;
  bool take(std::span<const std::uint8_t> report) noexcept override;
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

  struct Sent {
    PidReport report;
    std::int64_t time = 0;  // [ns]
  };
  std::array<Sent, pid_axes> sent_;
};

}  // namespace palpate
