// Rotation of a deformation gradient (theory.md section 7).
#pragma once

#include <Eigen/LU>

#include "meshes/mesh.h"

namespace palpate {

/// R of F = R S with S symmetric and det R = 1: the rotation nearest to F, which maximises tr(R^T F). Without
/// a singular value decomposition: Newton's iteration with scaling (Higham 1986) for most F; for F that is
/// flat, mirrored or nearly so the quaternion of Horn (1987), an eigenvector of a symmetric 4 x 4 matrix.
/// Defined for any finite F; if two singular values of a mirrored F coincide, it is one of many.
Mat3 nearest_rotation(const Mat3& F) noexcept;

/// Nearest rotation in the plane, from F's first two rows and columns.
Mat3 nearest_rotation_in_plane(const Mat3& F) noexcept;

/// Q of F = Q A with A upper triangular: the first axis follows the first column (Parker & O'Brien 2009).
/// Depends on the choice of axes; det Q = 1 for any F.
Mat3 rotation_by_qr(const Mat3& F) noexcept;

/// (tr U I - U)^-1 of F = R U: with it dR = R [spin]_x for the spin G axial(R^T dF).
inline Mat3 spin_of_skew(const Mat3& R, const Mat3& F) noexcept {
  const Mat3 U = 0.5 * (R.transpose() * F + F.transpose() * R);
  return (U.trace() * Mat3::Identity() - U).inverse();
}

/// Axial vector of A - A^T: v . axial(A) = [v]_x : A for any v.
inline Vec3 axial(const Mat3& A) noexcept {
  return {A(2, 1) - A(1, 2), A(0, 2) - A(2, 0), A(1, 0) - A(0, 1)};
}

/// Matrix [v]_x with [v]_x w = v x w.
inline Mat3 cross_matrix(const Vec3& v) noexcept {
  Mat3 A;
  A << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return A;
}

}  // namespace palpate
