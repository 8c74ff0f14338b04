// HID protocol of a home-made board.
#pragma once

#include <atomic>

#include "runtime/devices/hid/hid_protocol.h"
#include "runtime/devices/reports/palpate_board.h"
#include "runtime/safety/velocity_estimator.h"

namespace palpate {

/// The board numbers its reports. A report whose number is not ahead of the last one's is old and is dropped.
class HidBoard : public HidProtocol {
 public:
  /// Throws Error if the descriptor has no input report of 3 to 6 axes.
  HidBoard(const DeviceLimits& limits, const HidReportDescriptor& descriptor, std::string device,
           std::uint32_t last);

  [[nodiscard]] std::size_t input_bytes() const noexcept override { return board_input_bytes(axes_); }
  /// Reads the feature report: limits and unit of force.
  void start(HidDevice& device) override;
  bool take(std::span<const std::uint8_t> report) noexcept override;
  bool tell(bool heard, std::int64_t now, DeviceState& state) noexcept override;
  /// Sends the force together with the board's own number of the report behind `state`.
  void encode(const DeviceCommand& command, const DeviceState& state,
              OutputReports& reports) noexcept override;
  [[nodiscard]] std::vector<OutputReport> zero() const override;
  /// Returns the smaller of the profile's and the board's limits.
  [[nodiscard]] DeviceLimits limits() const override { return limits_; }

 private:
  DeviceLimits limits_;
  std::string device_;
  int axes_ = 0;
  BoardFeature feature_;
  std::uint32_t last_;
  BoardInput input_;
  bool heard_anything_ = false;
  /// Sequence number of the state minus the board's, which restarts when it is plugged in again. Set by the
  /// first report.
  std::atomic<std::uint32_t> ahead_ = 0;
  VelocityEstimator velocity_;
};

}  // namespace palpate
