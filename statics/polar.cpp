#include "statics/polar.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

namespace palpate {
namespace {

constexpr int most_iterations = 20;
constexpr double flat = 1e-6;  // det F relative to |F|^3 below which Newton's iteration is not tried

/// det F F^-T, defined for every F.
Mat3 cofactors(const Mat3& F) noexcept {
  Mat3 C;
  C.col(0) = F.col(1).cross(F.col(2));
  C.col(1) = F.col(2).cross(F.col(0));
  C.col(2) = F.col(0).cross(F.col(1));
  return C;
}

Mat3 rotation_by_quaternion(const Mat3& F) {
  if (!(F.cwiseAbs().maxCoeff() > 0.0)) return Mat3::Identity();
  const Mat3 A = F / F.cwiseAbs().maxCoeff();
  Eigen::Matrix4d N;
  N << A.trace(), A(2, 1) - A(1, 2), A(0, 2) - A(2, 0), A(1, 0) - A(0, 1),     //
      0.0, A(0, 0) - A(1, 1) - A(2, 2), A(0, 1) + A(1, 0), A(0, 2) + A(2, 0),  //
      0.0, 0.0, A(1, 1) - A(0, 0) - A(2, 2), A(1, 2) + A(2, 1),                //
      0.0, 0.0, 0.0, A(2, 2) - A(0, 0) - A(1, 1);
  N.triangularView<Eigen::StrictlyLower>() = N.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(N);
  const Eigen::Vector4d q = eigen.eigenvectors().col(3);
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
}

}  // namespace

Mat3 nearest_rotation(const Mat3& F) noexcept {
  if (!F.allFinite()) return Mat3::Identity();
  const double size = F.norm();
  if (!(F.determinant() > flat * size * size * size)) return rotation_by_quaternion(F);
  Mat3 R = F;
  for (int k = 0; k < most_iterations; ++k) {
    const Mat3 inverse = cofactors(R) / R.determinant();  // transposed
    const double scale = k < 3 ? std::sqrt(inverse.norm() / R.norm()) : 1.0;
    const Mat3 next = 0.5 * (scale * R + inverse / scale);
    const double change = (next - R).squaredNorm();
    R = next;
    if (change < 1e-15) return R;  // quadratic: the error is now below rounding
  }
  return R;
}

Mat3 nearest_rotation_in_plane(const Mat3& F) noexcept {
  const double c = F(0, 0) + F(1, 1), s = F(1, 0) - F(0, 1), length = std::sqrt(c * c + s * s);
  Mat3 R = Mat3::Identity();
  if (!(length > 0.0)) return R;
  R.topLeftCorner<2, 2>() << c / length, -s / length, s / length, c / length;
  return R;
}

Mat3 rotation_by_qr(const Mat3& F) noexcept {
  Vec3 a = F.col(0).stableNormalized();
  if (!(a.squaredNorm() > 0.5)) a = Vec3::UnitX();
  Vec3 b = F.col(1).stableNormalized();
  b -= a.dot(b) * a;
  b = b.norm() > flat ? (b - a.dot(b) * a).normalized() : a.unitOrthogonal();
  Mat3 Q;
  Q << a, b, a.cross(b);
  return Q;
}

}  // namespace palpate
