// Numbers and times that arithmetic can bear, whatever a device or a solver said.
#pragma once

#include <cmath>
#include <cstdint>

#include "runtime/safety/device.h"

namespace palpate {

/// Finite, and so small that products of two do not overflow.
inline bool is_plausible(double value) noexcept {
  return std::abs(value) < 1e100;
}

template <typename Derived>
bool is_plausible(const Eigen::DenseBase<Derived>& values) noexcept {
  return (values.derived().array().abs() < 1e100).all();
}

/// Pose and velocity.
inline bool is_plausible(const DeviceState& device) noexcept {
  return is_plausible(device.pose.position) && is_plausible(device.pose.orientation.coeffs()) &&
         is_plausible(device.velocity);
}

/// Wrench and local model.
inline bool is_plausible(const DeviceCommand& command) noexcept {
  return is_plausible(command.wrench.force) && is_plausible(command.wrench.torque) &&
         is_plausible(command.local.stiffness) && is_plausible(command.local.point);
}

/// From one monotonic time [ns] to another [s]: it cannot overflow.
inline double seconds_between(std::int64_t from, std::int64_t to) noexcept {
  return (static_cast<double>(to) - static_cast<double>(from)) * 1e-9;
}

}  // namespace palpate
