#include "runtime/core/body/surface_load.h"

#include <algorithm>

#include "runtime/core/body/elastic_body.h"
#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

std::size_t dofs(int dimension, Index nodes) noexcept {
  return static_cast<std::size_t>(dimension) * static_cast<std::size_t>(nodes);
}

}  // namespace

SurfaceLoad::SurfaceLoad(int d, Index near_nodes, Index stored_nodes, Index patch_nodes)
    : dimension(d),
      node(static_cast<std::size_t>(stored_nodes + patch_nodes)),
      force(dofs(d, stored_nodes + patch_nodes)),
      patch_place(static_cast<std::size_t>(patch_nodes > 0 ? near_nodes : 0)),
      patch_force(dofs(d, static_cast<Index>(patch_place.size()))),
      beside(dofs(d, patch_nodes)) {}

const Greens& SurfaceLoad::greens(const ElasticBody& body) const noexcept {
  return compliance != nullptr ? *compliance : body.greens();
}

void SurfaceLoad::clear() noexcept {
  count = 0;
  patch_count = 0;
  std::fill(beside.begin(), beside.end(), 0.0);
}

void SurfaceLoad::add(Index stored, const double* f) noexcept {
  node[count] = stored;
  std::copy_n(f, dimension, force.data() + dofs(dimension, count));
  ++count;
}

void SurfaceLoad::add_to_patch(Index place, const double* f) noexcept {
  patch_place[patch_count] = place;
  std::copy_n(f, dimension, patch_force.data() + dofs(dimension, patch_count));
  ++patch_count;
}

void patch_displacement(const SurfaceLoad& load, Index first, std::span<double> u) noexcept {
  const int d = load.dimension;
  const auto body_dofs = d * std::ssize(load.patch->stored_nodes());
  for (std::size_t k = 0; k < u.size(); ++k) {
    const Index dof = d * first + static_cast<Index>(k);
    const double* C = load.patch->compliance(dof);
    double sum = dot(load.patch->response(dof), load.beside.data(), body_dofs);
    if (load.patch->has_offset()) sum += load.patch->offset()[dof];
    for (Index i = 0; i < load.patch_count; ++i) {
      const double* by = C + dofs(d, load.patch_place[i]);
      const double* f = load.patch_force.data() + dofs(d, i);
      for (int axis = 0; axis < d; ++axis) sum += by[axis] * f[axis];
    }
    u[k] = sum;
  }
}

}  // namespace palpate
