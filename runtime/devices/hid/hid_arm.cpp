// HID protocol of the WoodenHaptics family.
#include <atomic>
#include <numbers>

#include "base/error.h"
#include "runtime/devices/hid/make_hid_protocol.h"
#include "runtime/devices/reports/woodenhaptics_report.h"
#include "runtime/safety/velocity_estimator.h"

namespace palpate {
namespace {

/// Largest displacement of the handle for one count of all three encoders, at position 0 [m], per axis.
Vec3 resolution(const ArmConstants& arm) {
  const Vec3 none = joint_angles(arm, {});
  const Vec3 step = (joint_angles(arm, {1, 1, 1, 0, 0, 0}) - none).cwiseAbs();
  const Vec3 angles = inverse_arm(arm, Vec3::Zero()).value_or(Vec3(0.0, 0.0, std::numbers::pi / 2.0));
  return arm_jacobian(arm, angles).cwiseAbs() * step;
}

/// The board answers each report that it is sent, so one is sent in each tick, even when no force changes.
/// That also feeds its watchdog of half a second.
class HidArm : public HidProtocol {
 public:
  HidArm(const ArmConstants& arm, const DeviceLimits& limits, std::string device, std::uint32_t last)
      : HidProtocol(limits),
        arm_(arm),
        device_(std::move(device)),
        sequence_(last),
        velocity_(resolution(arm)) {}

  [[nodiscard]] std::size_t input_bytes() const noexcept override { return woodenhaptics_report_bytes; }

  /// Sends the first report, all zeros.
  void start(HidDevice& device) override {
    if (!device.write(encode_currents(Vec3::Zero())))
      throw Error("the device does not take its first report", device_, "plug it in again");
  }

  bool take(std::span<const std::uint8_t> report) noexcept override {
    const auto encoders = decode_encoders(report);
    if (!encoders) return false;
    report_ = *encoders;
    if (report_.calibrate) calibrate_.store(true, std::memory_order_relaxed);
    return true;
  }

  bool tell(bool heard, std::int64_t now, DeviceState& state) noexcept override {
    if (!heard) return false;
    state = arm_state(arm_, report_);
    state.velocity = velocity_.take(state.pose.position, now);
    state.sequence = ++sequence_;
    return true;
  }

  /// Encodes motor currents by the arm's inverse kinematics; none if the position is out of reach. After a
  /// press of the calibrate button it encodes the counters of the calibration pose instead.
  void encode(const DeviceCommand& command, const DeviceState& state,
              OutputReports& reports) noexcept override {
    if (calibrate_.exchange(false, std::memory_order_relaxed)) {
      reports.add(encode_counters(arm_.calibration));
      return;
    }
    const auto angles = inverse_arm(arm_, state.pose.position);
    reports.add(
        encode_currents(angles ? motor_currents(arm_, *angles, command.wrench.force) : Vec3(Vec3::Zero())));
  }

  [[nodiscard]] std::vector<OutputReport> zero() const override {
    const auto report = encode_currents(Vec3::Zero());
    return {{report.begin(), report.end()}};
  }

 private:
  ArmConstants arm_;
  std::string device_;
  std::uint32_t sequence_;
  EncoderReport report_;
  VelocityEstimator velocity_;
  std::atomic<bool> calibrate_ = false;  // set by the reading thread, cleared by the writing thread
};

}  // namespace

std::unique_ptr<HidProtocol> make_hid_arm(const ArmConstants& arm, const DeviceLimits& limits,
                                          const std::string& device, std::uint32_t last) {
  return std::make_unique<HidArm>(arm, limits, device, last);
}

}  // namespace palpate
