#include "runtime/devices/reports/space_mouse.h"

#include <algorithm>
#include <cmath>

#include "runtime/devices/reports/little_endian.h"

namespace palpate {
namespace {

constexpr int largest_logical_count = 500;  // logical range of the first SpaceNavigators; 350 since

std::optional<std::array<std::int16_t, 3>> triple(std::span<const std::uint8_t> report,
                                                  std::size_t at) noexcept {
  std::array<std::int16_t, 3> counts{};
  for (std::size_t i = 0; i < 3; ++i) {
    counts[i] = read_number<std::int16_t>(report, at + 2 * i);
    if (counts[i] < -largest_logical_count || counts[i] > largest_logical_count) return std::nullopt;
  }
  return counts;
}

/// Returns the rate from -1 to 1, without the dead zone and continuous at its edge.
double rate(std::int16_t count, const SpaceMouseConstants& constants) noexcept {
  const double beyond = std::abs(static_cast<double>(count)) - constants.dead_zone;
  if (beyond <= 0.0) return 0.0;
  return std::copysign(std::min(1.0, beyond / (constants.full_scale - constants.dead_zone)), count);
}

Vec3 rates(const std::array<std::int16_t, 3>& counts, const SpaceMouseConstants& constants) noexcept {
  return {rate(counts[0], constants), rate(counts[1], constants), rate(counts[2], constants)};
}

}  // namespace

std::optional<SpaceMouseReport> decode_space_mouse(std::span<const std::uint8_t> report) noexcept {
  SpaceMouseReport result;
  const std::size_t size = report.size();
  if (size < 3) return std::nullopt;
  if (report[0] == 1 && (size == 7 || size == 13)) {
    result.translation = triple(report, 1);
    if (!result.translation) return std::nullopt;
    if (size == 13) {
      result.rotation = triple(report, 7);
      if (!result.rotation) return std::nullopt;
    }
  } else if (report[0] == 2 && size == 7) {
    result.rotation = triple(report, 1);
    if (!result.rotation) return std::nullopt;
  } else if (report[0] == 3 && size <= 7) {
    std::uint32_t buttons = 0;
    for (std::size_t i = 1; i < std::min<std::size_t>(size, 5); ++i) {
      buttons |= static_cast<std::uint32_t>(report[i]) << (8 * (i - 1));
    }
    result.buttons = buttons;
  } else {
    return std::nullopt;
  }
  return result;
}

void SpaceMouse::take(const SpaceMouseReport& report) noexcept {
  heard_ = 0.0;
  if (report.translation) {
    velocity_ =
        constants_.speed * rates(*report.translation, constants_).cwiseProduct(constants_.translation_signs);
  }
  if (report.rotation) {
    angular_velocity_ = constants_.turning_speed *
                        rates(*report.rotation, constants_).cwiseProduct(constants_.rotation_signs);
  }
  if (report.buttons) {
    state_.buttons = *report.buttons;
    state_.pose.grab = (state_.buttons & 1U) != 0;
  }
}

const DeviceState& SpaceMouse::advance(double dt) noexcept {
  heard_ += dt;
  if (heard_ > constants_.silence) {
    velocity_.setZero();
    angular_velocity_.setZero();
  }
  Vec3& position = state_.pose.position;
  const Vec3 before = position;
  position += dt * velocity_;
  const double distance = position.norm();
  if (distance > radius_) {
    position *= radius_ / distance;
    state_.velocity = dt > 0.0 ? Vec3((position - before) / dt) : Vec3::Zero();
  } else {
    state_.velocity = velocity_;
  }
  const double angle = dt * angular_velocity_.norm();
  if (angle > 0.0) {
    const Eigen::AngleAxisd turn(angle, angular_velocity_.normalized());
    state_.pose.orientation = (turn * state_.pose.orientation).normalized();
  }
  return state_;
}

}  // namespace palpate
