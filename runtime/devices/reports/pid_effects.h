// Effects by which a force-feedback joystick shows forces.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "runtime/devices/reports/pid_reports.h"

namespace palpate {

/// The wire to a joystick. False: the device does not take the report, or does not answer.
struct PidWire {
  std::function<bool(const PidReport&)> output, set_feature;
  std::function<bool(PidReport&)> get_feature;  ///< asks by id and length; the answer takes the place of both
};

/// Two constant effects, along x and y, that play without end.
class PidEffects {
 public:
  /// Keeps a reference to the layout.
  PidEffects(const PidLayout& layout, const PidConstants& constants) noexcept
      : layout_(layout), constants_(constants) {}

  /// Device reset, actuators on, then for each axis: Create New Effect, Block Load until it succeeds, Set
  /// Effect, Set Constant Force of 0, Effect Operation start. Why the device shows no forces; null where
  /// `force` may be sent from now on.
  [[nodiscard]] const char* start(const PidWire& wire);

  /// Set Constant Force for x and y, of parts that pid_force gives.
  [[nodiscard]] std::array<PidReport, pid_axes> force(
      const std::array<double, pid_axes>& parts) const noexcept;

  /// Output reports that set forces of 0, stop the effects and reset the device, however far `start` came.
  [[nodiscard]] std::vector<PidReport> stop() const;

 private:
  [[nodiscard]] const char* load(const PidWire& wire, std::uint32_t& block) const;

  const PidLayout& layout_;
  PidConstants constants_;
  std::array<std::uint32_t, pid_axes> blocks_{};  // 0: none yet
};

}  // namespace palpate
