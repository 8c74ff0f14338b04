#include "runtime/safety/stiffness_limit.h"

#include <Eigen/Eigenvalues>

#include "runtime/safety/plausible.h"

namespace palpate {

Mat3 limited_stiffness(const Mat3& stiffness, double most) noexcept {
  if (!is_plausible(stiffness)) return Mat3::Zero();
  Eigen::SelfAdjointEigenSolver<Mat3> eigen;
  eigen.computeDirect(Mat3(0.5 * (stiffness + stiffness.transpose())));
  const Mat3 vectors = eigen.eigenvectors();
  const Vec3 values = eigen.eigenvalues();
  if (!vectors.allFinite() || !values.allFinite()) return Mat3::Zero();
  return vectors * values.cwiseMax(0.0).cwiseMin(most).asDiagonal() * vectors.transpose();
}

}  // namespace palpate
