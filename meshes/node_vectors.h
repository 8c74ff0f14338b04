// Vectors of nodes in arrays of dofs: d numbers a node, in space for everybody else.
#pragma once

#include <cstddef>
#include <span>

#include "meshes/mesh.h"

namespace palpate {

/// The `dimension` numbers of node k as a vector in space; z = 0 in the plane.
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
