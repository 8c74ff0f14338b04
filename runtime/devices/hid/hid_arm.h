// HID protocol of the WoodenHaptics family.
#pragma once

#include <atomic>

#include "runtime/devices/hid/hid_protocol.h"
#include "runtime/devices/reports/woodenhaptics_report.h"
#include "runtime/safety/velocity_estimator.h"

namespace palpate {

/// The board answers each report that it receives, so one is sent per tick, even if the force is unchanged.
/// That also feeds its watchdog of half a second.
class HidArm : public HidProtocol {
 public:
  HidArm(const ArmConstants& arm, const DeviceLimits& limits, std::string device, std::uint32_t last);

  [[nodiscard]] std::size_t input_bytes() const noexcept override { return woodenhaptics_report_bytes; }
  /// Sends the first report, all zeros.
  void start(HidDevice& device) override;
  bool take(std::span<const std::uint8_t> report) noexcept override;
  bool tell(bool heard, std::int64_t now, DeviceState& state) noexcept override;
  /// Encodes motor currents by the arm's inverse kinematics; none if the position is out of reach. After a
  /// press of the calibrate button it encodes the counters of the calibration pose instead.
  void encode(const DeviceCommand& command, const DeviceState& state,
              OutputReports& reports) noexcept override;
  [[nodiscard]] std::vector<OutputReport> zero() const override;
  [[nodiscard]] DeviceLimits limits() const override { return limits_; }

 private:
  ArmConstants arm_;
  DeviceLimits limits_;
  std::string device_;
  std::uint32_t sequence_;
  EncoderReport report_;
  VelocityEstimator velocity_;
  std::atomic<bool> calibrate_ = false;  // set by the reading thread, cleared by the writing thread
};

}  // namespace palpate
