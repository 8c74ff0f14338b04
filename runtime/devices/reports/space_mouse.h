// 3Dconnexion SpaceMouse: six rates from a spring-centred cap, no force.
// Facts from AndunHH/spacemouse, SpaceNavigator.md and SpaceMouseWireless.md (captured reports), the
// SpaceNavigator's and the SpaceMouse Wireless's report descriptors, and FreeSpacenav/spacenavd, src/dev.c
// (ids).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "base/vectors.h"
#include "runtime/safety/device.h"

namespace palpate {

/// Contents of one report; a part that it does not have is empty.
struct SpaceMouseReport {
  std::optional<std::array<std::int16_t, 3>>
      translation{};                                      ///< right, to the user, down [counts, 350 is full]
  std::optional<std::array<std::int16_t, 3>> rotation{};  ///< about the same axes [counts]
  std::optional<std::uint32_t> buttons{};                 ///< bit k: button k is down
};

/// Decodes report 1 with 7 bytes (translation) or 13 (both), report 2 with 7 (rotation), report 3 with 3 to 7
/// (buttons). Empty for all others, such as the battery report, and for counts beyond 500, which no such
/// device sends.
[[nodiscard]] std::optional<SpaceMouseReport> decode_space_mouse(
    std::span<const std::uint8_t> report) noexcept;

/// Conversion from counts to velocities.
struct SpaceMouseConstants {
  double full_scale = 350.0;          ///< counts at the stop
  double dead_zone = 0.0;             ///< counts about 0 that are treated as 0
  double speed = 0.0;                 ///< speed at the stop [m/s]
  double turning_speed = 0.0;         ///< angular speed at the stop [rad/s]
  Vec3 translation_signs{1, -1, -1};  ///< signs for x right, y away from the user, z up
  Vec3 rotation_signs{1, -1, -1};     ///< signs about the same axes
  double silence = 0.1;               ///< time without a report after which it stands still [s]
};

/// Integrator of the cap's displacement, which is a velocity, to a pose.
class SpaceMouse {
 public:
  /// Starts at 0 and stays within `radius` of it [m].
  SpaceMouse(const SpaceMouseConstants& constants, double radius) noexcept
      : constants_(constants), radius_(radius) {}

  /// Updates the velocities from a report.
  void take(const SpaceMouseReport& report) noexcept;

  /// Integrates over `dt` [s]; at the boundary of the workspace it slides. The state has no time and sequence
  /// number.
  const DeviceState& advance(double dt) noexcept;

 private:
  SpaceMouseConstants constants_;
  double radius_;
  Vec3 velocity_ = Vec3::Zero();          // [m/s]
  Vec3 angular_velocity_ = Vec3::Zero();  // [rad/s]
  double heard_ = 0.0;                    // time since the last report [s]
  DeviceState state_;
};

}  // namespace palpate
