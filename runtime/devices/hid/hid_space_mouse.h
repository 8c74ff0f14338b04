// HID protocol of a SpaceMouse.
#pragma once

#include "runtime/devices/hid/hid_protocol.h"
#include "runtime/devices/reports/space_mouse.h"

namespace palpate {

/// Sends nothing while the cap rests, which is not a fault: a state is produced every millisecond, with or
/// without a report. It displays no force, whatever its profile states, so the engagement rule does not wait
/// for the hand. A lost device is detected by the read that fails.
class HidSpaceMouse : public HidProtocol {
 public:
  HidSpaceMouse(const SpaceMouseConstants& constants, const DeviceLimits& limits, std::uint32_t last) noexcept
      : limits_(limits), sequence_(last), mouse_(constants, limits.workspace_radius) {
    limits_.max_force = 0.0;
    limits_.max_torque = 0.0;
  }

  [[nodiscard]] std::size_t input_bytes() const noexcept override { return 13; }
  [[nodiscard]] int wait() const noexcept override { return 1; }
  void start(HidDevice& /*device*/) override {}
  bool take(std::span<const std::uint8_t> report) noexcept override;
  bool tell(bool heard, std::int64_t now, DeviceState& state) noexcept override;
  void encode(const DeviceCommand& /*command*/, const DeviceState& /*state*/,
              OutputReports& /*reports*/) noexcept override {}
  [[nodiscard]] std::vector<OutputReport> zero() const override { return {}; }
  [[nodiscard]] DeviceLimits limits() const override { return limits_; }

 private:
  DeviceLimits limits_;
  std::uint32_t sequence_;
  SpaceMouse mouse_;
  std::int64_t advanced_ = 0;  // time up to which the pose was integrated; 0: not yet [ns]
};

}  // namespace palpate
