// Bounds on the length of a vector and on its rate of change.
#pragma once

#include <cmath>

#include "base/vectors.h"

namespace palpate {

/// Returns the vector shortened to at most `most`; zero if its length is not finite.
inline Vec3 clamped(const Vec3& vector, double most) noexcept {
  const double length = vector.norm();
  if (!std::isfinite(length)) return Vec3::Zero();
  return length <= most ? vector : Vec3(vector * (most / length));
}

/// Vector that follows another one at a bounded rate. It stays inside any ball that contains the vector it
/// follows.
class RateClamp {
 public:
  /// `most`: largest rate of change [unit/s].
  explicit RateClamp(double most) noexcept : most_(most) {}

  /// Moves towards `wanted` for `time` [s] and returns the new value.
  Vec3 follow(const Vec3& wanted, double time) noexcept {
    const Vec3 change = wanted - value_;
    value_ = change.norm() <= most_ * time ? wanted : Vec3(value_ + clamped(change, most_ * time));
    return value_;
  }

  /// Scales the current value by `share`, when the followed vector was scaled outside this class.
  void scale(double share) noexcept { value_ *= share; }

  void reset() noexcept { value_.setZero(); }

 private:
  double most_;
  Vec3 value_ = Vec3::Zero();
};

}  // namespace palpate
