// HID protocol of a force-feedback joystick.
#include <algorithm>
#include <array>

#include "base/error.h"
#include "runtime/devices/hid/make_hid_protocol.h"
#include "runtime/devices/reports/pid_effects.h"
#include "runtime/safety/monotonic_clock.h"
#include "runtime/safety/velocity_estimator.h"

namespace palpate {
namespace {

constexpr std::int64_t repeat_after = 100'000'000;  // ns
constexpr std::int64_t still_after = 20'000'000;    // ns; without a report for longer it is at rest
constexpr std::int64_t millisecond = 1'000'000;     // ns

/// Travel of the handle per count of each axis [m].
Vec3 resolution(const PidLayout& layout, const PidConstants& constants) {
  Vec3 result = Vec3::Zero();
  for (std::size_t k = 0; k < pid_axes; ++k) {
    const HidElement& axis = layout.axes[k];
    const auto range = static_cast<double>(std::max<std::int64_t>(1, axis.logical_max - axis.logical_min));
    result[static_cast<Eigen::Index>(k)] = 2.0 * constants.half_travel[k] / range;
  }
  return result;
}

/// Two constant effects play without end, so that the last force goes on when no report follows: such a
/// device needs the guardian most. A report that equals the one before it is sent only every 0.1 s, as the
/// bus carries one per millisecond.
///
/// Many sticks report only what has changed. One that rests is not silent, so its last report is repeated,
/// with a new number, until it speaks: that it is gone is seen by reads and writes that fail, and that it
/// hangs by numbers that are frozen while a force is shown.
class HidJoystick : public HidProtocol {
 public:
  HidJoystick(const PidConstants& constants, const DeviceLimits& limits, const PidLayout& layout,
              std::string device, std::uint32_t last)
      : HidProtocol(limits),
        constants_(constants),
        layout_(layout),
        device_(std::move(device)),
        sequence_(last),
        effects_(layout_, constants_),
        velocity_(resolution(layout, constants)) {}

  [[nodiscard]] std::size_t input_bytes() const noexcept override {
    return std::size_t{layout_.axes[0].report_bytes} + (layout_.numbered ? 1 : 0);
  }

  /// Waiting time, shorter than the silence from which the force fades [ms].
  [[nodiscard]] int wait() const noexcept override { return 3; }

  /// Runs the PID start sequence. Throws Error with the step that the device failed.
  void start(HidDevice& device) override {
    const char* const failure = effects_.start(
        {.output = [&](const PidReport& report) { return device.write(report.span()); },
         .set_feature = [&](const PidReport& report) { return device.set_feature(report.span()); },
         .get_feature =
             [&](PidReport& report) {
               const int size = device.get_feature({report.bytes.data(), report.size});
               if (size >= 0) report.size = std::min(report.size, static_cast<std::size_t>(size));
               return size >= 0;
             }});
    if (failure != nullptr) {
      throw Error(failure, device_,
                  "plug it in again and close other programs that use its forces; if it stays so, its "
                  "firmware differs from PID");
    }
  }

  bool take(std::span<const std::uint8_t> report) noexcept override {
    const auto input = decode_pid_input(layout_, report);
    if (!input) return false;
    input_ = *input;
    return true;
  }

  /// False only before the first report. The sequence number advances by the milliseconds between two
  /// reports, so that no speed is computed from a repetition to a report.
  bool tell(bool heard, std::int64_t now, DeviceState& state) noexcept override {
    if (!heard && heard_ == 0) return false;
    const std::int64_t since = now - heard_;
    if (heard) {
      sequence_ += static_cast<std::uint32_t>(std::clamp(since, millisecond, still_after) / millisecond);
      heard_ = now;
      state_ = pid_state(constants_, input_);
      state_.velocity = velocity_.take(state_.pose.position, now);
    } else {
      ++sequence_;
      if (since > still_after) state_.velocity.setZero();
    }
    state = state_;
    state.sequence = sequence_;
    return true;
  }

  void encode(const DeviceCommand& command, const DeviceState&, OutputReports& reports) noexcept override {
    const auto forces = effects_.force(pid_force(constants_, command.wrench.force));
    const std::int64_t now = monotonic_now();
    for (std::size_t k = 0; k < pid_axes; ++k) {
      const bool is_same = std::ranges::equal(forces[k].span(), sent_[k].report.span());
      if (is_same && now - sent_[k].time < repeat_after) continue;
      sent_[k] = {forces[k], now};
      reports.add(forces[k].span());
    }
  }

  /// Returns reports that set both forces to 0, stop both effects and reset the device.
  [[nodiscard]] std::vector<OutputReport> zero() const override {
    std::vector<OutputReport> reports;
    for (const PidReport& report : effects_.stop())
      reports.emplace_back(report.span().begin(), report.span().end());
    return reports;
  }

 private:
  PidConstants constants_;
  PidLayout layout_;
  std::string device_;
  std::uint32_t sequence_;
  PidEffects effects_;
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

}  // namespace

std::unique_ptr<HidProtocol> make_hid_joystick(const PidConstants& constants, const DeviceLimits& limits,
                                               const PidLayout& layout, const std::string& device,
                                               std::uint32_t last) {
  return std::make_unique<HidJoystick>(constants, limits, layout, device, last);
}

}  // namespace palpate
