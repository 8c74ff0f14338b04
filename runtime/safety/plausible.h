// Checks that numbers and times from a device or a solver are safe to calculate with.
#pragma once

#include <cmath>
#include <cstdint>

#include "runtime/safety/device.h"

namespace palpate {

/// True if the value is finite and small enough that a product of two does not overflow.
inline bool is_plausible(double value) noexcept {
  return std::abs(value) < 1e100;
}

template <typename Derived>
bool is_plausible(const Eigen::DenseBase<Derived>& values) noexcept {
  return (values.derived().array().abs() < 1e100).all();
}

/// True if pose and velocity are plausible.
inline bool is_plausible(const DeviceState& device) noexcept {
  return is_plausible(device.pose.position) && is_plausible(device.pose.orientation.coeffs()) &&
         is_plausible(device.velocity);
}

/// True if wrench and local model are plausible.
inline bool is_plausible(const DeviceCommand& command) noexcept {
  return is_plausible(command.wrench.force) && is_plausible(command.wrench.torque) &&
         is_plausible(command.local.stiffness) && is_plausible(command.local.point);
}

/// Returns the time from one monotonic time [ns] to another [s]; cannot overflow.
inline double seconds_between(std::int64_t from, std::int64_t to) noexcept {
  return (static_cast<double>(to) - static_cast<double>(from)) * 1e-9;
}

}  // namespace palpate
