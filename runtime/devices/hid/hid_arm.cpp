#include "runtime/devices/hid/hid_arm.h"

#include <numbers>

#include "base/error.h"

namespace palpate {
namespace {

/// Largest displacement of the handle for one count of all three encoders, at position 0 [m], per axis.
Vec3 resolution(const ArmConstants& arm) {
  const Vec3 none = joint_angles(arm, {});
  const Vec3 step = (joint_angles(arm, {1, 1, 1, 0, 0, 0}) - none).cwiseAbs();
  const Vec3 angles = inverse_arm(arm, Vec3::Zero()).value_or(Vec3(0.0, 0.0, std::numbers::pi / 2.0));
  return arm_jacobian(arm, angles).cwiseAbs() * step;
}

}  // namespace

HidArm::HidArm(const ArmConstants& arm, const DeviceLimits& limits, std::string device, std::uint32_t last)
    : arm_(arm), limits_(limits), device_(std::move(device)), sequence_(last), velocity_(resolution(arm)) {}

void HidArm::start(HidDevice& device) {
  if (!device.write(encode_currents(Vec3::Zero()))) {
    throw Error("the device does not take its first report", device_, "plug it in again");
  }
}

bool HidArm::take(std::span<const std::uint8_t> report) noexcept {
  const auto encoders = decode_encoders(report);
  if (!encoders) return false;
  report_ = *encoders;
  if (report_.calibrate) calibrate_.store(true, std::memory_order_relaxed);
  return true;
}

bool HidArm::tell(bool heard, std::int64_t now, DeviceState& state) noexcept {
  if (!heard) return false;
  state = arm_state(arm_, report_);
  state.velocity = velocity_.take(state.pose.position, now);
  state.sequence = ++sequence_;
  return true;
}

void HidArm::encode(const DeviceCommand& command, const DeviceState& state, OutputReports& reports) noexcept {
  if (calibrate_.exchange(false, std::memory_order_relaxed)) {
    reports.add(encode_counters(arm_.calibration));
    return;
  }
  const auto angles = inverse_arm(arm_, state.pose.position);
  reports.add(encode_currents(angles ? motor_currents(arm_, *angles, command.wrench.force).value
                                     : Vec3(Vec3::Zero())));
}

std::vector<OutputReport> HidArm::zero() const {
  const auto report = encode_currents(Vec3::Zero());
  return {{report.begin(), report.end()}};
}

}  // namespace palpate
