#include "runtime/devices/hid/hid_joystick.h"

#include <algorithm>
#include <chrono>
#include <thread>

#include "base/error.h"
#include "runtime/safety/monotonic_clock.h"

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

bool same(const PidReport& a, const PidReport& b) noexcept {
  return std::ranges::equal(a.span(), b.span());
}

OutputReport copy(const PidReport& report) {
  return {report.span().begin(), report.span().end()};
}

}  // namespace

HidJoystick::HidJoystick(const PidConstants& constants, const DeviceLimits& limits, const PidLayout& layout,
                         std::string device, std::uint32_t last)
    : constants_(constants),
      limits_(limits),
      layout_(layout),
      device_(std::move(device)),
      sequence_(last),
      effects_(layout_, constants_),
      velocity_(resolution(layout, constants)) {}

std::size_t HidJoystick::input_bytes() const noexcept {
  return std::size_t{layout_.axes[0].report_bytes} + (layout_.numbered ? 1 : 0);
}

void HidJoystick::start(HidDevice& device) {
  using Kind = PidRequest::Kind;
  for (PidRequest request = effects_.next(); request.kind != Kind::none; request = effects_.next()) {
    if (request.kind == Kind::get_feature) {
      PidReport& report = request.report;
      const int size = device.get_feature({report.bytes.data(), report.size});
      if (size < 0) {
        effects_.refused();
      } else {
        effects_.received(report.span().first(std::min(report.size, static_cast<std::size_t>(size))));
      }
      // Some devices need a moment to load an effect.
      if (effects_.next().kind == Kind::get_feature)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    } else if (request.kind == Kind::output ? device.write(request.report.span())
                                            : device.set_feature(request.report.span())) {
      effects_.done();
    } else {
      effects_.refused();
    }
  }
  if (effects_.failure() != nullptr) {
    throw Error(effects_.failure(), device_,
                "plug it in again and close other programs that use its forces; if it stays so, its firmware "
                "differs from PID");
  }
}

bool HidJoystick::take(std::span<const std::uint8_t> report) noexcept {
  const auto input = decode_pid_input(layout_, report);
  if (!input) return false;
  input_ = *input;
  return true;
}

bool HidJoystick::tell(bool heard, std::int64_t now, DeviceState& state) noexcept {
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

void HidJoystick::encode(const DeviceCommand& command, const DeviceState&, OutputReports& reports) noexcept {
  const auto forces = effects_.force(pid_force(constants_, command.wrench.force));
  const std::int64_t now = monotonic_now();
  for (std::size_t k = 0; k < pid_axes; ++k) {
    if (same(forces[k], sent_[k].report) && now - sent_[k].time < repeat_after) continue;
    sent_[k] = {forces[k], now};
    reports.add(forces[k].span());
  }
}

std::vector<OutputReport> HidJoystick::zero() const {
  std::vector<OutputReport> reports;
  if (effects_.running()) {
    for (const PidReport& report : effects_.force({})) {
      reports.push_back(copy(report));
    }
  }
  PidSequence way_out = effects_;
  way_out.stop();
  for (PidRequest request = way_out.next(); request.kind == PidRequest::Kind::output;
       request = way_out.next()) {
    reports.push_back(copy(request.report));
    way_out.done();
  }
  return reports;
}

}  // namespace palpate
