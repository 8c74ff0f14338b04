#include "runtime/body/modes.h"

#include <string>

#include "base/error.h"
#include "runtime/solve/vector_loops.h"

namespace palpate {

Modes::Modes(const Model& model)
    : dimension_(model.dimension()), count_(model.dynamics.modes()), first_dropped_omega_(0.0) {
  const auto n = static_cast<std::size_t>(model.stored_dofs());
  const auto k = static_cast<std::size_t>(count_);
  const std::vector<double>& shapes = model.dynamics.shapes;
  if (model.dynamics.method != DynamicsMethod::modal || count_ < 1 || shapes.size() != k * n) {
    throw Error("the file has no modes of its " + std::to_string(n) + " stored dofs", model.name,
                "precompute it with [dynamics] and method = \"modal\"");
  }
  if (count_ > most_modes) {
    throw Error("the file has " + std::to_string(count_) + " modes", model.name,
                "precompute it with modes = " + std::to_string(most_modes) + " or fewer in [dynamics]");
  }
  omega_.assign(model.dynamics.omega.begin(), model.dynamics.omega.end() - 1);
  first_dropped_omega_ = model.dynamics.omega.back();
  rows_.resize(shapes.size());
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
