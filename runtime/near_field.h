// The compliance between the surface nodes near the tools, kept from tick to tick.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/body.h"

namespace palpate {

/// C = E^T Xi E [m/N] of the surface nodes near the tools (theory.md section 3), the forces on them and their
/// displacement. A tick gathers only what is new: one block row for each node that comes. Nodes that are held
/// along every axis do not move and have no place here. All memory is taken at construction.
class NearField {
 public:
  /// Empty, with room for `capacity` nodes.
  NearField(const Body& body, Index capacity);

  [[nodiscard]] int dimension() const noexcept { return dimension_; }  ///< d
  [[nodiscard]] Index count() const noexcept { return count_; }        ///< m, nodes that are here
  /// Place of a surface node, -1 when it is not here. Places change with `add` and `forget`.
  [[nodiscard]] Index place_of(Index surface_node) const noexcept {
    return place_[static_cast<std::size_t>(surface_node)];
  }
  /// Surface node at a place.
  [[nodiscard]] Index node(Index place) const noexcept { return nodes_[static_cast<std::size_t>(place)]; }
  /// Row of C [d m] of one dof, d place + axis.
  [[nodiscard]] std::span<const double> row(Index dof) const noexcept {
    return {C_.data() + static_cast<std::ptrdiff_t>(dof) * stride_,
            static_cast<std::size_t>(dimension_ * count_)};
  }

  /// Forgets a node or two that were not wanted for long. Call once a tick, before `want`.
  void begin_tick() noexcept;

  /// Sees to it that a node is here, with its displacement, in this tick; where there is no room the node
  /// that was not wanted for longest goes. False when all others are wanted or loaded.
  bool want(const Body& body, Index surface_node) noexcept;

  /// Takes all forces off.
  void unload() noexcept;
  /// Only a share of what the forces changed by since `unload`.
  void retreat(double share) noexcept;
  /// Adds to the force on the body at a place [N].
  void load(Index place, const Vec3& force) noexcept;
  /// u = C f: the displacement of all nodes here by the forces. Also lists the loaded nodes.
  void displace() noexcept;

  /// Displacement at a place by the forces of the last `displace` [m].
  [[nodiscard]] Vec3 displacement(Index place) const noexcept;
  /// Stored nodes that carry a force, and the forces on them, d numbers a node [N].
  [[nodiscard]] std::span<const Index> loaded_nodes() const noexcept {
    return {loaded_.data(), static_cast<std::size_t>(loaded_count_)};
  }
  [[nodiscard]] std::span<const double> loaded_forces() const noexcept {
    return {loaded_force_.data(), static_cast<std::size_t>(dimension_ * loaded_count_)};
  }

 private:
  void add(const Body& body, Index surface_node) noexcept;
  void forget(Index place) noexcept;
  [[nodiscard]] Index longest_unwanted() const noexcept;
  [[nodiscard]] bool is_loaded(Index place) const noexcept;

  int dimension_;
  Index capacity_;
  Index count_ = 0;
  Index loaded_count_ = 0;
  std::ptrdiff_t stride_;
  std::int64_t tick_ = 0;
  std::vector<Index> place_;          // [S]
  std::vector<Index> nodes_;          // [capacity] surface nodes
  std::vector<Index> stored_;         // [capacity] their stored nodes
  std::vector<std::int64_t> wanted_;  // [capacity] tick in which each was wanted last
  std::vector<double> C_;             // [d capacity x stride]
  std::vector<double> force_;         // [d capacity]
  std::vector<double> last_force_;    // [d capacity] before `unload`
  std::vector<double> displacement_;  // [d capacity]
  std::vector<double> blocks_;        // [d x d capacity] block row of a node that comes
  std::vector<Index> loaded_;         // [capacity]
  std::vector<double> loaded_force_;  // [d capacity]
};

}  // namespace palpate
