#include "runtime/safety/safety.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "base/error.h"
#include "runtime/safety/plausible.h"
#include "runtime/safety/stiffness_limit.h"

namespace palpate {
namespace {

SafetyOptions checked(const SafetyOptions& options) {
  const auto check = [](std::string_view name, const NumberRange& range, double value) {
    if (!range.contains(value))
      throw Error(fmt::format("{} must be {}, not {}", name, range.words, value), "SafetyOptions",
                  "give a number in that range");
  };
  check("period", positive_number, options.period);
  for_each_safety_field(
      options, [&](const SafetyField& field, double value) { check(field.name, field.range, value); });
  check("silence - silence_fade", positive_number, options.silence.most - options.silence.fade_from);
  return options;
}

}  // namespace

SafetyOptions limited(SafetyOptions options, const DeviceLimits& limits) noexcept {
  options.max_force = std::min(options.max_force, limits.max_force);
  options.max_torque = std::min(options.max_torque, limits.max_torque);
  options.max_stiffness = std::min(options.max_stiffness, limits.max_stiffness);
  options.max_damping = std::min(options.max_damping, limits.max_damping);
  return options;
}

Safety::Safety(const SafetyOptions& options, const DeviceLimits& limits)
    : options_(checked(limited(options, limits))),
      speed_limit_(options_.max_speed, options_.period),
      silence_(options_.silence),
      deadline_(options_.deadline, options_.period),
      buzz_(options_.buzz),
      stale_(options_.stale),
      gate_(options_.small_force, options_.calm_time),
      ramp_(options_.ramp),
      passivity_(options_.max_damping, options_.period),
      force_rate_(options_.max_force_rate),
      torque_rate_(options_.max_torque_rate) {}

DeviceCommand Safety::filter(const DeviceState& device, const DeviceCommand& wanted,
                             const TickTiming& timing) noexcept {
  const double elapsed = started_ ? std::max(0.0, seconds_between(last_now_, timing.now)) : options_.period;
  started_ = true;
  last_now_ = timing.now;
  if (shut_down_ || fault_ != Fault::none) return nothing();
  take(device, wanted, timing);
  deadline_.see(seconds_between(timing.due, timing.now), elapsed);
  buzz_.see(device_.velocity, shown_, timing.now, elapsed);
  look_for_faults();
  if (fault_ != Fault::none) return nothing();
  return pass(timing, elapsed);
}

void Safety::take(const DeviceState& device, const DeviceCommand& wanted, const TickTiming& timing) noexcept {
  if (silence_.observe(device, timing.now, shown_.norm())) {
    device_ = device;
    speed_limit_.see(device);
    passivity_.observe(device.pose.position);
  }
  if (is_plausible(wanted)) {
    solution_ = wanted;
    solution_.local.stiffness = limited_stiffness(wanted.local.stiffness, options_.max_stiffness);
    solved_ = timing.solved;
  }
}

void Safety::look_for_faults() noexcept {
  if (speed_limit_.failed()) fail(Fault::too_fast);
  if (!felt_ && (silence_.silent() || deadline_.failed())) {
    begin_anew();
    deadline_.reset();
    return;
  }
  if (silence_.silent()) fail(Fault::device_silent);
  if (silence_.frozen()) fail(Fault::device_frozen);
  if (deadline_.failed()) fail(Fault::deadline_missed);
  if (buzz_.failed()) fail(Fault::buzzing);
}

DeviceCommand Safety::nothing() noexcept {
  shown_.setZero();
  share_ = 0.0;
  DeviceCommand command;
  command.local.point = device_.pose.position;
  return command;
}

DeviceCommand Safety::pass(const TickTiming& timing, double elapsed) noexcept {
  const double time = std::min(elapsed, options_.period);  // no leap after a gap
  bridge_gap(elapsed);
  const Vec3 field = stale_.force(solution_, device_.pose.position, device_.velocity,
                                  std::max(0.0, seconds_between(solved_, timing.now)), elapsed);
  if (stale_.share() <= 0.0) begin_anew();
  share_ = 0.0;
  if (gate_.pass(field.norm(), timing.inside_body, time))
    share_ = ramp_.advance(time) * deadline_.share() * silence_.share() * stale_.share() * buzz_.share();

  Vec3 scaled = Vec3::Zero();
  if (gate_.open()) scaled = passivity_.control(share_ * field, silence_.share() * device_.velocity);
  shown_ = force_rate_.follow(clamped(scaled, options_.max_force), time);
  passivity_.set_displayed(shown_);
  felt_ = felt_ || !shown_.isZero(0.0);

  DeviceCommand command;
  command.wrench.force = shown_;
  command.wrench.torque =
      torque_rate_.follow(clamped(share_ * solution_.wrench.torque, options_.max_torque), time);
  command.local = local_model(scaled, share_);
  return command;
}

/// Scales the force as the device did during a gap between ticks, when it let it fade as a stale solution.
void Safety::bridge_gap(double elapsed) noexcept {
  const double past = (elapsed - options_.stale.time_to_live) / options_.stale.fade;
  if (past <= 0.0) return;
  const double left = std::max(0.0, 1.0 - past);
  force_rate_.scale(left);
  torque_rate_.scale(left);
  if (left <= 0.0) begin_anew();
}

/// Starts again: the gate waits until the tool is out of contact, then the ramp begins at zero.
void Safety::begin_anew() noexcept {
  gate_.close();
  ramp_.restart();
  passivity_.reset();
}

LocalModel Safety::local_model(const Vec3& wanted, double share) const noexcept {
  LocalModel local;
  local.force = shown_;
  local.point = device_.pose.position;
  if (shown_ != wanted) return local;  // limited by a clamp: no slope
  local.stiffness = share * solution_.local.stiffness;
  const double left = solution_.local.radius - (local.point - solution_.local.point).norm();
  const double room = (options_.max_force - shown_.norm()) / std::max(local.stiffness.norm(), 1e-9);
  const double radius = std::min(left, room);
  local.radius = is_plausible(radius) ? std::max(0.0, radius) : 0.0;
  return local;
}

void Safety::restart() noexcept {
  speed_limit_.reset();
  silence_.reset();
  deadline_.reset();
  buzz_.reset();
  stale_.reset();
  gate_.close();
  ramp_.restart();
  passivity_.reset();
  force_rate_.reset();
  torque_rate_.reset();
  shown_.setZero();
  share_ = 0.0;
  started_ = false;
  felt_ = false;
}

void Safety::fail(Fault fault) noexcept {
  if (fault_ == Fault::none) fault_ = fault;
}

void Safety::acknowledge() noexcept {
  if (fault_ == Fault::none) return;
  fault_ = Fault::none;
  restart();
}

SafetyPhase Safety::phase() const noexcept {
  if (shut_down_) return SafetyPhase::shut_down;
  if (fault_ != Fault::none) return SafetyPhase::faulted;
  if (!gate_.open()) return SafetyPhase::waiting;
  return ramp_.share() < 1.0 ? SafetyPhase::ramping : SafetyPhase::active;
}

}  // namespace palpate
