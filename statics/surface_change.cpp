#include "statics/surface_change.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "statics/polar.h"

namespace palpate {
namespace {

/// Two edges and the normal; in the plane the edge, its normal and z.
Mat3 frame_of(const std::array<Vec3, 3>& x, std::size_t dimension) noexcept {
  Mat3 frame;
  frame.col(0) = x[1] - x[0];
  if (dimension == 2) {
    frame.col(1) = Vec3::UnitZ().cross(x[1] - x[0]).normalized();
    frame.col(2) = Vec3::UnitZ();
  } else {
    frame.col(1) = x[2] - x[0];
    frame.col(2) = (x[1] - x[0]).cross(x[2] - x[0]).normalized();
  }
  return frame;
}

/// True if a simplex with `change` = |F - I| of its deformation gradient can exceed the largest so far: its
/// stretches differ from 1 by no more, and its rotation R has |R - I| <= 2 |F - I|.
bool can_be_larger(const SurfaceChange& largest, double change) noexcept {
  return change > largest.strain || change > std::numbers::sqrt2 * std::sin(0.5 * largest.rotation);
}

}  // namespace

SurfaceChange surface_change(int dimension, std::span<const Index> simplices, std::span<const Vec3> rest,
                             std::span<const Vec3> u) noexcept {
  SurfaceChange largest;
  const auto d = static_cast<std::size_t>(dimension);
  for (std::size_t first = 0; first + d <= simplices.size(); first += d) {
    std::array<Vec3, 3> X, x;
    for (std::size_t k = 0; k < d; ++k) {
      const auto node = static_cast<std::size_t>(simplices[first + k]);
      X[k] = rest[node];
      x[k] = rest[node] + u[node];
    }
    const Mat3 rest_frame = frame_of(X, d);
    const Mat3 change = (frame_of(x, d) - rest_frame) * rest_frame.inverse();
    if (!change.allFinite()) continue;  // skip a degenerate simplex
    if (!can_be_larger(largest, change.norm())) continue;
    const Mat3 F = Mat3::Identity() + change;
    const Mat3 R = nearest_rotation(F);
    largest.rotation = std::max(largest.rotation, std::acos(std::clamp(0.5 * (R.trace() - 1.0), -1.0, 1.0)));
    const Eigen::SelfAdjointEigenSolver<Mat3> stretches(F.transpose() * F, Eigen::EigenvaluesOnly);
    for (const double squared : stretches.eigenvalues())
      largest.strain = std::max(largest.strain, std::abs(std::sqrt(std::max(squared, 0.0)) - 1.0));
  }
  return largest;
}

}  // namespace palpate
