// Saturation of a command at the limit of a device.
#pragma once

#include "base/vectors.h"

namespace palpate {

/// Scales `wanted` as a whole until no entry exceeds `largest`, which keeps its direction. If it is not
/// finite, returns zero.
[[nodiscard]] inline Vec3 saturate(const Vec3& wanted, double largest) noexcept {
  if (!wanted.allFinite()) return Vec3::Zero();
  const double peak = wanted.cwiseAbs().maxCoeff();
  return peak <= largest ? wanted : Vec3(wanted * (largest / peak));
}

}  // namespace palpate
