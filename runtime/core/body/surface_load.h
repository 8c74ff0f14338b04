// Load that determines the displacement of the whole surface.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "runtime/core/body/greens.h"
#include "runtime/core/body/local_compliance.h"
#include "runtime/core/body/patch.h"

namespace palpate {

class ElasticBody;

/// Forces of a tick. Assigning one of the same body and capacities allocates nothing.
struct SurfaceLoad {
  /// Capacities: loaded nodes near the tools, stored nodes that they follow, and nodes g of a patch.
  SurfaceLoad(const ElasticBody& body, Index near_nodes, Index stored_nodes, Index patch_nodes);

  void clear() noexcept;
  /// Adds a force [N] on a stored node.
  void add(Index stored, const double* force) noexcept;
  /// Adds a force [N] on a surface node of the patch, given by its place there.
  void add_to_patch(Index place, const double* force) noexcept;
  /// Adds a force [N] on a surface node, for the local compliance alone.
  void add_point(Index node, const Vec3& force) noexcept;
  /// Call after the last of these.
  void lump_points() noexcept;
  /// Displacement [m] of a surface node by the local compliance, beside that of the stored nodes.
  [[nodiscard]] Vec3 local_displacement(Index node) const noexcept;
  /// Displacement [m] by the local compliance of a node that is not close to the forces: in less time.
  [[nodiscard]] Vec3 far_local_displacement(Index node) const noexcept;
  /// The body's local compliance where it holds: not with a patch.
  [[nodiscard]] const LocalCompliance* local_now() const noexcept {
    return patch == nullptr ? local.get() : nullptr;
  }
  /// Rotation with which the local compliance of a point has turned.
  [[nodiscard]] Mat3 rotation(const LocalCompliance::Point& at) const noexcept {
    return compliance != nullptr ? compliance->rotation(at.follows) : Mat3(Mat3::Identity());
  }
  /// Displacement [m] of a point by a force [N] on another, by the local compliance.
  [[nodiscard]] Vec3 by_force(const LocalCompliance::Point& at, const LocalCompliance::Point& loaded,
                              const Vec3& f) const noexcept;
  /// True if forces on the surface nodes of a patch fit.
  [[nodiscard]] bool fits(const Patch& other) const noexcept {
    return !other.is_sampled() || other.fine_dofs() <= std::ptrdiff_t{dimension} * Patch::most_nodes;
  }

  /// Stored nodes and forces on them, d numbers each [N], that displace the body without the overlay as it is
  /// with the overlay.
  [[nodiscard]] std::span<const Index> nodes() const noexcept {
    return {node.data(), static_cast<std::size_t>(count)};
  }
  [[nodiscard]] std::span<const double> forces() const noexcept {
    return {force.data(), static_cast<std::size_t>(dimension * count)};
  }

  /// Compliance for the forces: `compliance`, or the body's Green's functions, with a local compliance that
  /// of the smooth part.
  [[nodiscard]] const Greens& greens(const ElasticBody& body) const noexcept;

  int dimension;  ///< d
  Index count = 0;
  std::vector<Index> node;
  std::vector<double> force;
  std::shared_ptr<const Patch> patch;            ///< null if there is no overlay
  std::shared_ptr<const Greens> compliance;      ///< for a body that has changed; null: the body's
  std::shared_ptr<const LocalCompliance> local;  ///< null: none
  Index point_count = 0;                         ///< number of forces for the local compliance
  std::vector<Index> point;                      ///< surface nodes
  std::vector<Vec3> point_force;
  Eigen::AlignedBox3d points_box;                ///< box round these at rest
  std::array<LocalCompliance::Point, 8> lump{};  ///< all forces of an eighth of that box together
  std::array<Vec3, 8> lump_force{};
  Index patch_count = 0;  ///< number of forces on nodes of the patch's fine mesh
  std::vector<Index> patch_place;
  std::vector<double> patch_force;
  std::vector<Index> first_force;  ///< [most_nodes] place of a node's force in these two; -1: none
  std::vector<double> beside;  ///< [d g] displacement of Q by forces outside the patch, without overlay [m]
};

/// Computes the displacement [m], d numbers each, of the patch's surface nodes from place `first` on, as many
/// as fit.
void patch_displacement(const SurfaceLoad& load, Index first, std::span<double> u) noexcept;

}  // namespace palpate
