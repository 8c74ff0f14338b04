#include "runtime/core/body/surface_load.h"

#include <algorithm>

#include "runtime/core/body/elastic_body.h"
#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

std::size_t dofs(int dimension, Index nodes) noexcept {
  return static_cast<std::size_t>(dimension) * static_cast<std::size_t>(nodes);
}

bool is_in_local_reach(const SurfaceLoad& load, Index node) noexcept {
  return load.point_count > 0 && load.points_box.squaredExteriorDistance(load.local->point(node).x) <
                                     load.local->reach() * load.local->reach();
}

}  // namespace

SurfaceLoad::SurfaceLoad(const ElasticBody& body, Index near_nodes, Index stored_nodes, Index patch_nodes)
    : dimension(body.dimension()),
      node(static_cast<std::size_t>(stored_nodes + patch_nodes)),
      force(dofs(dimension, stored_nodes + patch_nodes)),
      local(body.local()),
      point(static_cast<std::size_t>(local != nullptr ? near_nodes : 0)),
      point_force(point.size()),
      patch_place(static_cast<std::size_t>(patch_nodes > 0 ? std::max(near_nodes, Patch::most_nodes) : 0)),
      patch_force(dofs(dimension, static_cast<Index>(patch_place.size()))),
      first_force(static_cast<std::size_t>(patch_nodes > 0 ? Patch::most_nodes : 0), -1),
      beside(dofs(dimension, patch_nodes)) {}

const Greens& SurfaceLoad::greens(const ElasticBody& body) const noexcept {
  if (compliance != nullptr) return *compliance;
  return local_now() != nullptr ? local->smooth() : body.greens();
}

void SurfaceLoad::clear() noexcept {
  count = 0;
  point_count = 0;
  points_box.setEmpty();
  for (Index i = 0; i < patch_count; ++i) {
    if (patch_place[i] < Patch::most_nodes) first_force[patch_place[i]] = -1;
  }
  patch_count = 0;
  std::fill(beside.begin(), beside.end(), 0.0);
}

void SurfaceLoad::add(Index stored, const double* f) noexcept {
  node[count] = stored;
  std::copy_n(f, dimension, force.data() + dofs(dimension, count));
  ++count;
}

void SurfaceLoad::add_point(Index surface_node, const Vec3& f) noexcept {
  if (local_now() == nullptr) return;
  point[static_cast<std::size_t>(point_count)] = surface_node;
  point_force[static_cast<std::size_t>(point_count)] = f;
  points_box.extend(local->point(surface_node).x);
  ++point_count;
}

void SurfaceLoad::lump_points() noexcept {
  if (point_count == 0) return;
  std::array<double, 8> sum{};
  std::fill(lump_force.begin(), lump_force.end(), Vec3::Zero());
  const Vec3 middle = points_box.center();
  for (std::size_t k = 0; k < static_cast<std::size_t>(point_count); ++k) {
    const LocalCompliance::Point& p = local->point(point[k]);
    const double weight = point_force[k].norm();
    if (weight == 0.0) continue;
    const std::size_t eighth = (p.x.x() > middle.x() ? 1U : 0U) + (p.x.y() > middle.y() ? 2U : 0U) +
                               (p.x.z() > middle.z() ? 4U : 0U);
    sum[eighth] += weight;
    const Vec3 x = lump[eighth].x + weight / sum[eighth] * (p.x - lump[eighth].x);
    lump[eighth] = p;
    if (sum[eighth] > weight) lump[eighth].x = x;
    lump_force[eighth] += point_force[k];
  }
}

Vec3 SurfaceLoad::by_force(const LocalCompliance::Point& at, const LocalCompliance::Point& loaded,
                           const Vec3& f) const noexcept {
  const Mat3 B = local->between(at, loaded);
  if (compliance == nullptr) return B * f;
  return rotation(at) * (B * (rotation(loaded).transpose() * f));
}

Vec3 SurfaceLoad::local_displacement(Index surface_node) const noexcept {
  Vec3 sum = Vec3::Zero();
  if (!is_in_local_reach(*this, surface_node)) return sum;
  for (std::size_t k = 0; k < static_cast<std::size_t>(point_count); ++k)
    sum += by_force(local->point(surface_node), local->point(point[k]), point_force[k]);
  return sum;
}

Vec3 SurfaceLoad::far_local_displacement(Index surface_node) const noexcept {
  Vec3 sum = Vec3::Zero();
  if (!is_in_local_reach(*this, surface_node)) return sum;
  for (std::size_t k = 0; k < lump.size(); ++k) {
    if (!lump_force[k].isZero(0.0)) sum += by_force(local->point(surface_node), lump[k], lump_force[k]);
  }
  return sum;
}

void SurfaceLoad::add_to_patch(Index place, const double* f) noexcept {
  patch->for_each_part(place, [&](Index fine, double weight) {
    Index at = patch->is_sampled() ? first_force[fine] : -1;
    if (at < 0) {
      at = patch_count++;
      if (patch->is_sampled()) first_force[fine] = at;
      patch_place[at] = fine;
      std::fill_n(patch_force.data() + dofs(dimension, at), dimension, 0.0);
    }
    palpate::add(f, weight, patch_force.data() + dofs(dimension, at), dimension);
  });
}

void patch_displacement(const SurfaceLoad& load, Index first, std::span<double> u) noexcept {
  const int d = load.dimension;
  const auto body_dofs = d * std::ssize(load.patch->stored_nodes());
  for (std::size_t k = 0; k < u.size(); ++k) {
    const Index axis = static_cast<Index>(k) % d;
    u[k] = 0.0;
    load.patch->for_each_part(first + static_cast<Index>(k) / d, [&](Index node, double weight) {
      const Index dof = d * node + axis;
      const double* C = load.patch->compliance(dof);
      double sum = dot(load.patch->response(dof), load.beside.data(), body_dofs);
      if (load.patch->has_offset()) sum += load.patch->offset()[dof];
      for (Index i = 0; i < load.patch_count; ++i) {
        const double* by = C + dofs(d, load.patch_place[i]);
        const double* f = load.patch_force.data() + dofs(d, i);
        for (int j = 0; j < d; ++j) sum += by[j] * f[j];
      }
      u[k] += weight * sum;
    });
  }
}

}  // namespace palpate
