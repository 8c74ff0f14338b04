// Velocity of a handle from positions of finite resolution.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "base/vectors.h"

namespace palpate {

/// Velocity by first-order adaptive windowing, end fit (Janabi-Sharifi, Hayward, Chen 2000, "Discrete-time
/// adaptive windowing for velocity estimation"). For each axis it is the slope from an earlier position to
/// the newest, over the longest window (at most 15 positions) in which all positions lie within the
/// resolution of that line. Windows are long while the motion is uniform, which suppresses quantisation, and
/// short where it changes.
class VelocityEstimator {
 public:
  static constexpr std::size_t most_places = 15;

  /// `resolution` [m]: distance between two neighbouring readings of the device, per axis. A position is
  /// accurate to half of it, so a line through two readings misses a third one by at most all of it.
  explicit VelocityEstimator(const Vec3& resolution) noexcept : resolution_(resolution) {}

  /// Returns the velocity [m/s] at `position` [m], measured at `time` [ns]. 0 at the first position;
  /// unchanged if no time has passed.
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

  /// Returns the position `ago` samples before the newest.
  [[nodiscard]] const Place& place(std::size_t ago) const noexcept {
    return places_[(newest_ + most_places - ago) % most_places];
  }

  /// Slope from `ago` samples before the newest to the newest [m/s].
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
