// Node vectors in arrays of dofs: d numbers per node in the array, vectors in space in the code.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>

namespace palpate {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
/// Numbers of nodes, elements and facets. Counts of bytes and of matrix entries are std::int64_t.
using Index = std::int32_t;

/// Vector of node k from its `dimension` numbers; z = 0 in the plane.
inline Vec3 vector_at(std::span<const double> values, int dimension, Index k) noexcept {
  const double* v = values.data() + std::ptrdiff_t{dimension} * k;
  return {v[0], v[1], dimension == 3 ? v[2] : 0.0};
}

/// Sets the `dimension` numbers of node k; the vector's z is ignored in the plane.
inline void set_vector(std::span<double> values, int dimension, Index k, const Vec3& vector) noexcept {
  double* v = values.data() + std::ptrdiff_t{dimension} * k;
  v[0] = vector.x();
  v[1] = vector.y();
  if (dimension == 3) v[2] = vector.z();
}

}  // namespace palpate
