// What is left of a command that is more than a device can do.
#pragma once

#include "meshes/mesh.h"

namespace palpate {

/// A command within bounds, and how much of what was asked for that is.
struct Saturated {
  Vec3 value = Vec3::Zero();
  double shown = 1.0;  ///< 1: all of it; less: value is so much of the wanted; 0: it was not a number
};

/// `wanted` scaled as a whole until no entry is larger than `largest`, so that its direction stays. A wanted
/// that is not finite becomes zero.
[[nodiscard]] inline Saturated saturate(const Vec3& wanted, double largest) noexcept {
  if (!wanted.allFinite()) return {Vec3::Zero(), 0.0};
  const double peak = wanted.cwiseAbs().maxCoeff();
  if (peak <= largest) return {wanted, 1.0};
  return {wanted * (largest / peak), largest / peak};
}

}  // namespace palpate
