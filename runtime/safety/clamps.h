// Bounds on a vector and on how fast it changes.
#pragma once

#include <cmath>

#include "meshes/mesh.h"

namespace palpate {

/// The vector shortened to at most `most`; zero where the length is no number.
inline Vec3 clamped(const Vec3& vector, double most) noexcept {
  const double length = vector.norm();
  if (!std::isfinite(length)) return Vec3::Zero();
  return length <= most ? vector : Vec3(vector * (most / length));
}

/// A vector that follows another at a bounded rate. Within a ball it stays, as long as what it follows does.
class RateClamp {
 public:
  /// `most`: of change [unit/s].
  explicit RateClamp(double most) noexcept : most_(most) {}

  /// After `time` [s].
  Vec3 follow(const Vec3& wanted, double time) noexcept {
    const Vec3 change = wanted - value_;
    value_ = change.norm() <= most_ * time ? wanted : Vec3(value_ + clamped(change, most_ * time));
    return value_;
  }

  /// What it follows had a share of the last value meanwhile.
  void scale(double share) noexcept { value_ *= share; }

  void reset() noexcept { value_.setZero(); }

 private:
  double most_;
  Vec3 value_ = Vec3::Zero();
};

}  // namespace palpate
