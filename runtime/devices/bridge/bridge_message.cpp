#include "runtime/devices/bridge/bridge_message.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "runtime/safety/monotonic_clock.h"
#include "runtime/safety/plausible.h"

namespace palpate {
namespace {

static_assert(sizeof(bridge_state) == 112 && sizeof(bridge_command) == 128, "as the book has them");

constexpr double max_distance = 10.0;    // m
constexpr double max_speed = 100.0;      // m/s
constexpr double unit_tolerance = 0.01;  // deviation of a quaternion's length from 1
constexpr double max_age = 0.020;        // s; a device that has been silent this long displays no force
constexpr double max_ahead = 1.0;        // s; a time further ahead is from another clock
constexpr std::size_t head_bytes = 8;    // magic and version

/// xx, yy, zz, xy, yz, zx
constexpr std::array<std::pair<Eigen::Index, Eigen::Index>, 6> stiffness_order = {
    {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}}};

float as_float(double value) noexcept {
  constexpr double most = std::numeric_limits<float>::max();  // beyond it a conversion is not defined
  return static_cast<float>(std::clamp(value, -most, most));
}

std::uint16_t milliseconds(double time) noexcept {
  return static_cast<std::uint16_t>(std::lround(std::clamp(1e3 * time, 0.0, 65535.0)));
}

std::uint32_t mode_of(const DeviceCommand& command) noexcept {
  const bool has_model = command.local.radius > 0.0;
  const bool is_zero = command.wrench.force.isZero(0.0) && command.wrench.torque.isZero(0.0) &&
                       (!has_model || command.local.stiffness.isZero(0.0));
  if (is_zero || !is_plausible(command)) return BRIDGE_ZERO;
  return has_model ? BRIDGE_LOCAL_MODEL : BRIDGE_FORCE;
}

DeviceLimits limits_of(const bridge_state& said) noexcept {
  const auto limit = [&](std::size_t k) {
    return said.limits[k] == 0.0F ? std::numeric_limits<double>::infinity() : double{said.limits[k]};
  };
  return {limit(0), limit(1), limit(2), limit(3), limit(4)};
}

}  // namespace

Refusal read_bridge_state(const bridge_state& said, std::size_t size, std::int64_t now,
                          BridgeState& state) noexcept {
  if (size < head_bytes) return Refusal::size;
  // Checked before the size, which may differ between versions.
  if (std::memcmp(said.magic, "PLPS", sizeof said.magic) != 0 || said.version != BRIDGE_VERSION)
    return Refusal::version;
  if (size != sizeof said) return Refusal::size;
  const Vec3 position = Eigen::Map<const Vec3>(said.position);
  const Vec3 velocity = Eigen::Map<const Vec3>(said.velocity);
  const float* w = said.orientation;
  const Eigen::Quaterniond orientation{w[0], w[1], w[2], w[3]};
  const auto is_finite = [](float value) { return std::isfinite(value); };
  const auto is_negative = [](float value) { return value < 0.0F; };
  if (!position.allFinite() || !velocity.allFinite() || !orientation.coeffs().allFinite() ||
      !std::ranges::all_of(said.limits, is_finite)) {
    return Refusal::not_finite;
  }
  if (!(position.norm() <= max_distance) || !(velocity.norm() <= max_speed) ||
      std::ranges::any_of(said.limits, is_negative)) {
    return Refusal::implausible;
  }
  if (std::abs(orientation.norm() - 1.0) > unit_tolerance) return Refusal::orientation;
  const double age = 1e-9 * (static_cast<double>(now) - static_cast<double>(said.time));
  if (age > max_age || age < -max_ahead) return Refusal::age;

  state.device = {};
  state.device.sequence = said.sequence;
  state.device.arrived = now;
  state.device.buttons = said.flags & BRIDGE_BUTTONS;
  state.device.pose.grab = (said.flags & 1U) != 0;
  state.device.pose.position = position;
  state.device.pose.orientation = orientation.normalized();
  state.device.velocity = velocity;
  state.limits = limits_of(said);
  state.fault = (said.flags & BRIDGE_DEVICE_FAULT) != 0;
  return Refusal::none;
}

bridge_command make_bridge_command(const DeviceCommand& command, std::uint32_t answers,
                                   const StaleOptions& stale, double max_force) noexcept {
  bridge_command told{};
  std::memcpy(told.magic, "PLPC", sizeof told.magic);
  told.version = BRIDGE_VERSION;
  told.answers = answers;
  told.mode = mode_of(command);
  told.time = static_cast<std::uint64_t>(monotonic_now());
  told.damping = as_float(stale.damping);
  told.max_force = as_float(max_force);
  told.time_to_live = milliseconds(stale.time_to_live);
  told.fade = milliseconds(stale.fade);
  if (told.mode == BRIDGE_ZERO) return told;
  const LocalModel& local = command.local;
  Eigen::Map<Vec3>(told.force) = command.wrench.force;
  Eigen::Map<Vec3>(told.point) = local.point;
  Eigen::Map<Eigen::Vector3f>(told.torque) = command.wrench.torque.unaryExpr(&as_float);
  for (std::size_t k = 0; k < stiffness_order.size(); ++k) {
    const auto [row, column] = stiffness_order[k];
    told.stiffness[k] = as_float(0.5 * (local.stiffness(row, column) + local.stiffness(column, row)));
  }
  told.radius = as_float(local.radius);
  return told;
}

}  // namespace palpate
