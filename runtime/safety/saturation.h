// Saturation of a command at the limit of a device.
#pragma once

#include "base/vectors.h"

namespace palpate {

/// Command within bounds, and the fraction of the request that it amounts to.
struct Saturated {
  Vec3 value = Vec3::Zero();
  double shown = 1.0;  ///< value / wanted: 1 if not saturated; 0 if wanted was not finite
};

/// Scales `wanted` as a whole until no entry exceeds `largest`, which keeps its direction. If it is not
/// finite, returns zero.
[[nodiscard]] inline Saturated saturate(const Vec3& wanted, double largest) noexcept {
  if (!wanted.allFinite()) return {Vec3::Zero(), 0.0};
  const double peak = wanted.cwiseAbs().maxCoeff();
  if (peak <= largest) return {wanted, 1.0};
  return {wanted * (largest / peak), largest / peak};
}

}  // namespace palpate
