// The compliance between the surface nodes near the tools, kept from tick to tick.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/memory.h"
#include "runtime/body/body.h"
#include "runtime/body/nodal_load.h"
#include "runtime/body/patch.h"
#include "runtime/body/surface_load.h"

namespace palpate {

/// C = E^T Xi E [m/N] of the surface nodes near the tools (theory.md section 3), the forces on them and their
/// displacement. A tick gathers only what is new: one block row for each node that comes. Nodes that are held
/// along every axis do not move and have no place here.
///
/// With a patch, Xi is that of the body with the overlay: between surface nodes of the patch it is there,
/// between them (H) and others (X = Xi_Q, of forces there without the overlay) it is H X, and between others
/// Xi + X^T M X (theory.md section 4). A group of surface nodes (Body::aggregate_node) has a place as a node
/// has: its displacement is a mean of the members', its force acts on all of them by the same weights. There
/// are none with a patch. All memory is taken at construction.
class NearField {
 public:
  /// Empty, with room for `capacity` nodes and for patches of up to `patch_nodes` nodes g.
  NearField(const Body& body, Index capacity, Index patch_nodes = 0);

  [[nodiscard]] int dimension() const noexcept { return dimension_; }  ///< d
  [[nodiscard]] Index count() const noexcept { return count_; }        ///< m, nodes that are here
  [[nodiscard]] Index capacity() const noexcept { return capacity_; }  ///< most of them
  /// Place of a surface node, -1 when it is not here. Places change with `add` and `forget`.
  [[nodiscard]] Index place_of(Index surface_node) const noexcept { return place_[surface_node]; }
  /// Surface node at a place.
  [[nodiscard]] Index node(Index place) const noexcept { return nodes_[place]; }
  /// Row of C [d m] of one dof, d place + axis. At each node four numbers may be read, whatever the last is.
  [[nodiscard]] std::span<const double> row(Index dof) const noexcept {
    return {C_.data() + static_cast<std::ptrdiff_t>(dof) * stride_,
            static_cast<std::size_t>(dimension_ * count_)};
  }

  /// Takes down how far nodes have moved, and forgets one or two that were not wanted for long. Call once a
  /// tick, before `want`.
  void begin_tick() noexcept;

  /// Sees to it that a node is here, with its displacement, in this tick; where there is no room the node
  /// that was not wanted for longest goes. False when all others are wanted or loaded.
  bool want(const Body& body, Index surface_node) noexcept;

  /// Whether a surface node was wanted in this tick.
  [[nodiscard]] bool is_wanted(Index surface_node) const noexcept {
    const Index place = place_of(surface_node);
    return place >= 0 && wanted_[at(place)] == tick_;
  }
  /// Puts a group here: a force f at its place puts maps[k] f on its k-th member, and its displacement is the
  /// sum of maps[k]^T u_k. `weights` and `maps` are by Body::aggregates' members; `weights`, whose sum is 1,
  /// are for whoever wants means, and where one is 0 the member does not belong to it. The others have to be
  /// here. False where there is no room, where the group is here already and carries force or was wanted in
  /// this tick (by other members), or with a patch.
  bool want_group(const Body& body, Index group, std::span<const double> weights,
                  std::span<const Eigen::Matrix3d> maps) noexcept;
  /// Whether a place is that of a group.
  [[nodiscard]] bool is_group(Index place) const noexcept { return node(place) >= surface_nodes_; }
  /// Calls visit(surface node, weight, map) for the nodes that belong to the group at a place.
  template <class Visit>
  void for_each_member(Index place, Visit&& visit) const noexcept {
    const std::size_t first = at(most_members_ * place);
    for (std::size_t k = first; k < first + at(member_count_[at(place)]); ++k)
      visit(member_[k], member_weight_[k], member_map_[k]);
  }

  /// The overlay that is in C, null for none.
  [[nodiscard]] const std::shared_ptr<const Patch>& patch() const noexcept { return load_.patch; }
  /// Gathers all of C anew, with another overlay or none. Forces and displacement stay as they are, so that
  /// nothing that is touched jumps away: the next forces are those of the new C. Nodes that were not wanted
  /// in this tick are forgotten. False, and nothing happens, when the patch is larger than there is room for,
  /// or groups are wanted.
  bool change_patch(const Body& body, std::shared_ptr<const Patch> patch) noexcept;
  /// Gathers all of C anew from another compliance, null for the body's Green's functions. Forces stay as
  /// they are, their displacement does not. Nodes that were not wanted in this tick are forgotten where there
  /// are no groups.
  void change_compliance(const Body& body, std::shared_ptr<const Greens> compliance) noexcept;
  /// How often all of C was gathered anew. As long as it is the same, so is what C has between two nodes that
  /// stay.
  [[nodiscard]] std::int64_t revision() const noexcept { return revision_; }
  /// Place of a surface node in the patch, -1 when it is beside it.
  [[nodiscard]] Index place_in_patch(Index surface_node) const noexcept {
    return place_in_patch_[surface_node];
  }

  /// Takes all forces off.
  void unload() noexcept;
  /// Only a share of what the forces changed by since `unload`.
  void retreat(double share) noexcept;
  /// Adds to the force on the body at a place [N].
  void load(Index place, const Vec3& force) noexcept;
  /// u = C f: the displacement of all nodes here by the forces, and what the rest of the surface follows
  /// from.
  void displace() noexcept;

  /// Adds what forces [d m] at the places here put on stored nodes, as `load` has it of the forces that are
  /// here; as many as there is room for.
  void put_on_stored_nodes(std::span<const double> forces, NodalLoad& stored) noexcept;

  /// Force on the body at a place [N].
  [[nodiscard]] Vec3 force(Index place) const noexcept;
  /// Displacement at a place by the forces of the last `displace` [m].
  [[nodiscard]] Vec3 displacement(Index place) const noexcept;
  /// Displacement at a place without forces [m]: zero but for patches that have an offset.
  [[nodiscard]] Vec3 offset(Index place) const noexcept;
  /// What the displacement at a place changed by in the tick before [m]; zero where it was not here.
  [[nodiscard]] Vec3 last_motion(Index place) const noexcept;
  /// The forces of the last `displace`.
  [[nodiscard]] const SurfaceLoad& load() const noexcept { return load_; }

 private:
  void add(const Body& body, Index surface_node) noexcept;
  void forget(Index place) noexcept;
  void enter(const Body& body, Index place) noexcept;
  void follow(const Body& body, Index place, Index surface_node) noexcept;
  void leave(Index place) noexcept;
  void move(Index from, Index to) noexcept;
  void connect(const Body& body, Index place) noexcept { connect(body, place, place + 1); }
  void connect(const Body& body, Index place, Index count) noexcept;
  void connect_by_members(Index place, Index count) noexcept;
  void connect_to_group(Index group, const double* by, double* block) const noexcept;
  void connect_within_patch(Index place) noexcept;
  void connect_beside_patch(const Body& body, Index place) noexcept;
  void respond(const Body& body, Index place) noexcept;
  void find_offset(Index place) noexcept;
  void spread(std::span<const double> forces) noexcept;
  void load_base(std::size_t part, const Vec3& f) noexcept;
  void load_bases(Index place, const Vec3& f) noexcept;
  void load_patch(Index place) noexcept;
  template <class Visit>
  void for_each_stored_force(Visit&& visit) const noexcept;
  [[nodiscard]] Index longest_unwanted() const noexcept;
  [[nodiscard]] bool is_loaded(Index place) const noexcept;
  [[nodiscard]] Index patch_place(Index place) const noexcept { return place_in_patch(node(place)); }
  /// Row [d g] of X or Y of a dof.
  [[nodiscard]] double* X(Index dof) noexcept { return X_.data() + std::ptrdiff_t{dof} * patch_stride_; }
  [[nodiscard]] double* Y(Index dof) noexcept { return Y_.data() + std::ptrdiff_t{dof} * patch_stride_; }
  [[nodiscard]] std::ptrdiff_t patch_dofs() const noexcept {
    return dimension_ * std::ssize(load_.patch->stored_nodes());
  }

  static std::size_t at(Index i) noexcept { return static_cast<std::size_t>(i); }

  int dimension_;
  Index capacity_;
  Index surface_nodes_;  // S
  Index parts_;          // room of each place for stored nodes that it follows
  Index most_members_;
  Index count_ = 0;
  std::ptrdiff_t stride_;
  std::ptrdiff_t patch_stride_;
  Index patch_room_;
  std::int64_t tick_ = 0;
  std::int64_t revision_ = 0;
  std::vector<Index> place_;           // [S + groups]
  std::vector<Index> place_in_patch_;  // [S + groups]
  std::vector<Index> nodes_;           // [capacity] surface nodes
  std::vector<std::int64_t> wanted_;   // [capacity] tick in which each was wanted last
  LargeVector<double> C_;              // [d capacity x stride]
  std::vector<double> force_;          // [d capacity]
  std::vector<double> last_force_;     // [d capacity] before `unload`
  std::vector<double> displacement_;   // [d capacity]
  std::vector<double> begun_;          // [d capacity] displacement at the tick's begin
  std::vector<double> last_motion_;    // [d capacity]
  std::vector<double> offset_;         // [d capacity] displacement without forces
  std::vector<double> blocks_;         // [d x d capacity] block row of a node that comes
  // Stored nodes that those beside the patch follow, each once.
  Index base_count_ = 0;
  std::vector<Index> base_;                  // [parts capacity, of the stored nodes at most] stored nodes
  std::vector<Index> base_uses_;             // [as base] nodes that follow each
  std::vector<Index> base_of_stored_;        // [stored nodes] -1 for none
  std::vector<Index> bases_of_;              // [parts x capacity] of each node
  std::vector<double> part_weight_;          // [parts x capacity]
  std::vector<Index> part_count_;            // [capacity]
  std::vector<Index> member_count_;          // [capacity] of places that are groups'
  std::vector<Index> member_;                // [members x capacity] surface nodes of the group
  std::vector<double> member_weight_;        // [as these]
  std::vector<Eigen::Matrix3d> member_map_;  // [as these]
  std::vector<double> by_base_;              // [d x d parts capacity] displacement of a node that comes
  std::vector<double> gathered_;             // [d x d max(parts capacity, patch room)]
  std::vector<double> base_force_;           // [d parts capacity]
  LargeVector<double> X_, Y_;        // [d capacity x patch stride] X and M X of nodes beside the patch
  std::vector<double> patch_force_;  // [d patch room] on Q
  SurfaceLoad load_;
};

}  // namespace palpate
