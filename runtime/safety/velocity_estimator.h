// How fast a handle moves, from places that are known to a resolution only.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "meshes/mesh.h"

namespace palpate {

/// Velocity by first-order adaptive windowing, end fit (Janabi-Sharifi, Hayward, Chen 2000, "Discrete-time
/// adaptive windowing for velocity estimation"): along each axis the slope from an earlier place to the
/// newest, over the longest window (at most 15 places) whose places all lie within the resolution of that
/// line. Long windows where the motion is even, so that quantisation hardly counts; short ones where it
/// changes.
class VelocityEstimator {
 public:
  static constexpr std::size_t most_places = 15;

  /// `resolution` [m]: what two neighbouring numbers of the device mean. A place is known to half of it, so a
  /// line through two measured places misses a third one by at most all of it.
  explicit VelocityEstimator(const Vec3& resolution) noexcept : resolution_(resolution) {}

  /// The velocity [m/s] at `position` [m], measured at `time` [ns]. 0 at the first place; as before where no
  /// time has passed.
  Vec3 take(const Vec3& position, std::int64_t time) noexcept {
    if (count_ > 0 && time <= place(0).time) return velocity_;
    newest_ = (newest_ + 1) % most_places;
    places_[newest_] = {position, time};
    if (count_ < most_places) ++count_;
    for (int axis = 0; axis < 3; ++axis) {
      velocity_[axis] = slope(axis);
    }
    return velocity_;
  }

 private:
  struct Place {
    Vec3 position = Vec3::Zero();
    std::int64_t time = 0;
  };

  /// The one of so many places before the newest.
  [[nodiscard]] const Place& place(std::size_t ago) const noexcept {
    return places_[(newest_ + most_places - ago) % most_places];
  }

  /// From `ago` places before the newest to it [m/s].
  [[nodiscard]] double slope_over(int axis, std::size_t ago) const noexcept {
    return (place(0).position[axis] - place(ago).position[axis]) / seconds_since(ago);
  }

  [[nodiscard]] double seconds_since(std::size_t ago) const noexcept {
    return 1e-9 * static_cast<double>(place(0).time - place(ago).time);
  }

  [[nodiscard]] double slope(int axis) const noexcept {
    constexpr double rounding = 1.0 + 1e-9;
    double result = 0.0;
    for (std::size_t window = 1; window < count_; ++window) {
      const double wider = slope_over(axis, window);
      for (std::size_t ago = 1; ago < window; ++ago) {
        const double on_line = place(0).position[axis] - wider * seconds_since(ago);
        if (std::abs(place(ago).position[axis] - on_line) > rounding * resolution_[axis]) return result;
      }
      result = wider;
    }
    return result;
  }

  Vec3 resolution_;
  std::array<Place, most_places> places_{};
  std::size_t newest_ = 0;
  std::size_t count_ = 0;
  Vec3 velocity_ = Vec3::Zero();
};

}  // namespace palpate
