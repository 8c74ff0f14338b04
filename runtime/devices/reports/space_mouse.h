// 3Dconnexion SpaceMouse: six rates of a cap that springs back, no force.
// Facts from AndunHH/spacemouse, SpaceNavigator.md and SpaceMouseWireless.md (captured reports), the
// SpaceNavigator's and the SpaceMouse Wireless's report descriptors, and FreeSpacenav/spacenavd, src/dev.c
// (ids).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "meshes/mesh.h"
#include "runtime/safety/device.h"

namespace palpate {

/// What one report said; what it did not speak of is empty.
struct SpaceMouseReport {
  std::optional<std::array<std::int16_t, 3>>
      translation{};                                      ///< right, to the user, down [counts, 350 is full]
  std::optional<std::array<std::int16_t, 3>> rotation{};  ///< about those axes [counts]
  std::optional<std::uint32_t> buttons{};                 ///< bit k: button k is down
};

/// Report 1 with 7 bytes (translation) or 13 (both), report 2 with 7 (rotation), report 3 with 3 to 7
/// (buttons). Empty for all others, such as the battery's, and for counts beyond 500, which no such device
/// sends.
[[nodiscard]] std::optional<SpaceMouseReport> decode_space_mouse(
    std::span<const std::uint8_t> report) noexcept;

/// From counts to metres.
struct SpaceMouseConstants {
  double full_scale = 350.0;          ///< counts at the stop
  double dead_zone = 0.0;             ///< counts about 0 that are 0
  double speed = 0.0;                 ///< at the stop [m/s]
  double turning_speed = 0.0;         ///< at the stop [rad/s]
  Vec3 translation_signs{1, -1, -1};  ///< to x right, y from the user, z up
  Vec3 rotation_signs{1, -1, -1};     ///< about those axes
  double silence = 0.1;               ///< after so long without a report it stands still [s]
};

/// Rates to a place: the cap's displacement is a velocity, of which this is the integral.
class SpaceMouse {
 public:
  /// Starts at 0 and stays within `radius` of it [m].
  SpaceMouse(const SpaceMouseConstants& constants, double radius) noexcept
      : constants_(constants), radius_(radius) {}

  /// Takes note of a report.
  void take(const SpaceMouseReport& report) noexcept;

  /// Goes on for `dt` [s]; at the workspace's wall it slides. Without time and number.
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
