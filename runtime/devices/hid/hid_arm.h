// The WoodenHaptics family on the wire.
#pragma once

#include <atomic>

#include "runtime/devices/hid/hid_protocol.h"
#include "runtime/devices/reports/woodenhaptics_report.h"
#include "runtime/safety/velocity_estimator.h"

namespace palpate {

/// The board answers each report that it is told, so there is one in each tick, also when no force changes;
/// that feeds its watchdog of half a second, too.
class HidArm : public HidProtocol {
 public:
  HidArm(const ArmConstants& arm, const DeviceLimits& limits, std::string device, std::uint32_t last);

  [[nodiscard]] std::size_t input_bytes() const noexcept override { return woodenhaptics_report_bytes; }
  /// The first report of zeros.
  void start(HidDevice& device) override;
  bool take(std::span<const std::uint8_t> report) noexcept override;
  bool tell(bool heard, std::int64_t now, DeviceState& state) noexcept override;
  /// Currents by the arm's inverse kinematics, none where the place is out of its reach. After the calibrate
  /// button the counters of the calibration pose instead.
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
  std::atomic<bool> calibrate_ = false;  // read, but not yet answered by the thread that writes
};

}  // namespace palpate
