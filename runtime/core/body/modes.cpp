#include "runtime/core/body/modes.h"

#include "runtime/core/solve/vector_loops.h"

namespace palpate {

Modes::Modes(int dimension, std::span<const double> omega, std::span<const double> shapes)
    : dimension_(dimension),
      count_(static_cast<Index>(omega.size()) - 1),
      omega_(omega.begin(), omega.end() - 1),
      first_dropped_omega_(omega.back()),
      rows_(shapes.size()) {
  const auto k = static_cast<std::size_t>(count_);
  const std::size_t n = shapes.size() / k;
  for (std::size_t mode = 0; mode < k; ++mode) {
    for (std::size_t dof = 0; dof < n; ++dof) rows_[dof * k + mode] = shapes[mode * n + dof];
  }
}

void Modes::add_projection(std::span<const Index> nodes, std::span<const double> f, double factor,
                           std::span<double> modal) const noexcept {
  const auto d = static_cast<std::size_t>(dimension_);
  for (std::size_t k = 0; k < f.size(); ++k) {
    const std::int64_t dof = std::int64_t{dimension_} * nodes[k / d] + static_cast<std::int64_t>(k % d);
    add(row(dof), factor * f[k], modal.data(), count_);
  }
}

Vec3 Modes::displacement(Index stored, std::span<const double> q) const noexcept {
  Vec3 u = Vec3::Zero();
  for (int axis = 0; axis < dimension_; ++axis)
    u[axis] = dot(row(std::int64_t{dimension_} * stored + axis), q.data(), count_);
  return u;
}

}  // namespace palpate
