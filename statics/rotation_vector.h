// Rotations from rotation vectors (axis times angle).
#pragma once

#include <cmath>

#include "statics/polar.h"

namespace palpate {

/// (1 - cos t) / t^2 for an angle t.
inline double cosine_share(double t) noexcept {
  const double half = std::sin(0.5 * t);
  return t * t < 1e-16 ? 0.5 : 2.0 * half * half / (t * t);
}

/// exp([w]_x): rotation about w by |w| [rad] (Rodrigues).
inline Mat3 exp_of(const Vec3& w) noexcept {
  const double t = w.norm();
  const double sine_share = t < 1e-8 ? 1.0 : std::sin(t) / t;
  const Mat3 W = cross_matrix(w);
  return Mat3::Identity() + sine_share * W + cosine_share(t) * W * W;
}

/// Right Jacobian J_r: exp(w + v) = exp(w) exp(J_r v) to first order in v.
inline Mat3 right_jacobian(const Vec3& w) noexcept {
  const double t = w.norm();
  const double cubic = t < 1e-3 ? 1.0 / 6.0 - t * t / 120.0 : (t - std::sin(t)) / (t * t * t);
  const Mat3 W = cross_matrix(w);
  return Mat3::Identity() - cosine_share(t) * W + cubic * W * W;
}

}  // namespace palpate
