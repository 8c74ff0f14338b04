// What the displacement of the whole surface follows from.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "runtime/body/greens.h"
#include "runtime/body/patch.h"

namespace palpate {

class Body;

/// The forces of a tick. Taking one over another of the same body and room allocates nothing.
struct SurfaceLoad {
  /// Room for so many loaded nodes near the tools, stored nodes that those follow, and nodes g of a patch.
  SurfaceLoad(int dimension, Index near_nodes, Index stored_nodes, Index patch_nodes);

  void clear() noexcept;
  /// Adds a force [N] on a stored node.
  void add(Index stored, const double* force) noexcept;
  /// Adds a force [N] on a surface node of the patch, by its place there.
  void add_to_patch(Index place, const double* force) noexcept;

  /// Forces on stored nodes, d numbers each [N], that move the body without the overlay as it is with it.
  [[nodiscard]] std::span<const Index> nodes() const noexcept {
    return {node.data(), static_cast<std::size_t>(count)};
  }
  [[nodiscard]] std::span<const double> forces() const noexcept {
    return {force.data(), static_cast<std::size_t>(dimension * count)};
  }

  /// What the forces act by: `compliance` or the body's Green's functions.
  [[nodiscard]] const Greens& greens(const Body& body) const noexcept;

  int dimension;  ///< d
  Index count = 0;
  std::vector<Index> node;
  std::vector<double> force;
  std::shared_ptr<const Patch> patch;        ///< null: no overlay
  std::shared_ptr<const Greens> compliance;  ///< of a body that has changed; null: the body's
  Index patch_count = 0;                     ///< forces on surface nodes of the patch
  std::vector<Index> patch_place;
  std::vector<double> patch_force;
  std::vector<double> beside;  ///< [d g] displacement of Q by the forces beside the patch, without it [m]
};

/// Displacement [m], d numbers each, of the patch's surface nodes from place `first` on, as many as fit.
void patch_displacement(const SurfaceLoad& load, Index first, std::span<double> u) noexcept;

}  // namespace palpate
