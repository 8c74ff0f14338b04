// Compliance between the surface nodes near the tools, kept from tick to tick.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/memory.h"
#include "runtime/core/body/elastic_body.h"
#include "runtime/core/body/followed_nodes.h"
#include "runtime/core/body/nodal_load.h"
#include "runtime/core/body/patch.h"
#include "runtime/core/body/surface_load.h"

namespace palpate {

/// C = E^T Xi E [m/N] of the surface nodes near the tools (theory.md section 3), the forces on them and their
/// displacement. A tick gathers only one block row per new node. Nodes held along every axis do not move and
/// have no place here.
///
/// With a patch, Xi is that of the body with the overlay. Between surface nodes of the patch it is the
/// patch's compliance, between them (H) and others (X = Xi_Q, by forces there without the overlay) it is H X,
/// and between others Xi + X^T M X (theory.md section 4). Without one, a local compliance of the body counts.
/// A group of surface nodes (ElasticBody::aggregate_node) has a place like a node: its displacement is a mean
/// of its members', its force acts on all of them with the same weights. There are no groups with a patch.
/// All memory is allocated at construction.
class NearField {
 public:
  /// Empty, with a capacity of `capacity` nodes and of patches of up to `patch_nodes` nodes g.
  NearField(const ElasticBody& body, Index capacity, Index patch_nodes = 0);

  [[nodiscard]] int dimension() const noexcept { return dimension_; }  ///< d
  [[nodiscard]] Index count() const noexcept { return count_; }        ///< m, number of nodes
  [[nodiscard]] Index capacity() const noexcept { return capacity_; }  ///< largest number of nodes
  /// Place of a surface node; -1 if it is not here. Places change with `add` and `forget`.
  [[nodiscard]] Index place_of(Index surface_node) const noexcept { return place_[surface_node]; }
  /// Surface node at a place.
  [[nodiscard]] Index node(Index place) const noexcept { return nodes_[place]; }
  /// Row of C [d m] of one dof, d place + axis. Four numbers may be read at every node, including the last.
  [[nodiscard]] std::span<const double> row(Index dof) const noexcept {
    return {C_.data() + static_cast<std::ptrdiff_t>(dof) * stride_,
            static_cast<std::size_t>(dimension_ * count_)};
  }

  /// Records the displacement change of the nodes, and removes one or two that have not been wanted for long.
  /// Call once per tick, before `want`.
  void begin_tick() noexcept;

  /// Ensures that a node is here, with its displacement, in this tick. If the capacity is full, it replaces
  /// the node that has not been wanted for longest. False if all others are wanted or loaded.
  bool want(const ElasticBody& body, Index surface_node) noexcept;

  /// True if a surface node was wanted in this tick.
  [[nodiscard]] bool is_wanted(Index surface_node) const noexcept {
    const Index place = place_of(surface_node);
    return place >= 0 && wanted_[at(place)] == tick_;
  }
  /// Adds a group: a force f at its place exerts maps[k] f on its k-th member, and its displacement is the
  /// sum of maps[k]^T u_k. `weights` and `maps` are in the order of ElasticBody::aggregates' members;
  /// `weights` sum to 1 and define averages; a zero weight excludes the member. All other members must be
  /// here. False if the capacity is full, if the group is here already and is loaded or was wanted in this
  /// tick (with other members), or with a patch.
  bool want_group(const ElasticBody& body, Index group, std::span<const double> weights,
                  std::span<const Eigen::Matrix3d> maps) noexcept;
  /// Stored nodes that the nodes beside the patch follow, in no order.
  [[nodiscard]] std::span<const Index> followed() const noexcept { return followed_.nodes(); }
  /// Largest number of these.
  [[nodiscard]] Index followed_room() const noexcept { return followed_.room(); }
  /// True if a place is that of a group.
  [[nodiscard]] bool is_group(Index place) const noexcept { return node(place) >= surface_nodes_; }
  /// Calls visit(surface node, weight, map) for the members of the group at a place.
  template <class Visit>
  void for_each_member(Index place, Visit&& visit) const noexcept {
    const std::size_t first = at(most_members_ * place);
    for (std::size_t k = first; k < first + at(members_.count[at(place)]); ++k)
      visit(members_.node[k], members_.weight[k], members_.map[k]);
  }

  /// Overlay included in C; null for none.
  [[nodiscard]] const std::shared_ptr<const Patch>& patch() const noexcept { return load_.patch; }
  /// Gathers C again, with another overlay or none. Forces and displacement are kept, so that a touched
  /// surface does not jump; the next forces are those of the new C. Nodes not wanted in this tick are
  /// removed. False, and nothing changes, if the patch exceeds the capacity, or groups are wanted.
  bool change_patch(const ElasticBody& body, std::shared_ptr<const Patch> patch) noexcept;
  /// Gathers C again from another compliance; null for the body's Green's functions. Forces are kept, their
  /// displacement is not. Nodes not wanted in this tick are removed if there are no groups.
  void change_compliance(const ElasticBody& body, std::shared_ptr<const Greens> compliance) noexcept;
  /// Number of times that C was gathered completely. While it is the same, C between two remaining nodes is
  /// too.
  [[nodiscard]] std::int64_t revision() const noexcept { return revision_; }
  /// Place of a surface node in the patch; -1 if it is outside.
  [[nodiscard]] Index place_in_patch(Index surface_node) const noexcept {
    return beside_.place_in_patch[surface_node];
  }

  /// Removes all forces.
  void unload() noexcept;
  /// Scales the change of the forces since `unload` by `share`.
  void retreat(double share) noexcept;
  /// Adds to the force on the body at a place [N].
  void load(Index place, const Vec3& force) noexcept;
  /// u = C f: computes the displacement of all nodes here by the forces, and the load for the rest of the
  /// surface.
  void displace() noexcept;

  /// Adds to `stored` the load on stored nodes by forces [d m] at the places here, as many as fit.
  void put_on_stored_nodes(std::span<const double> forces, NodalLoad& stored) noexcept;

  /// Force on the body at a place [N].
  [[nodiscard]] Vec3 force(Index place) const noexcept;
  /// Displacement at a place by the forces of the last `displace` [m].
  [[nodiscard]] Vec3 displacement(Index place) const noexcept;
  /// Displacement at a place without forces [m]: zero except for patches with an offset.
  [[nodiscard]] Vec3 offset(Index place) const noexcept;
  /// Change of the displacement at a place in the last tick [m]; zero if it was not here.
  [[nodiscard]] Vec3 last_motion(Index place) const noexcept;
  /// Blocks of C that the nodes added in this tick have needed, one for each node that was here.
  [[nodiscard]] Index added_blocks() const noexcept { return added_blocks_; }
  /// Load of the last `displace`.
  [[nodiscard]] const SurfaceLoad& load() const noexcept { return load_; }

 private:
  void add(const ElasticBody& body, Index surface_node) noexcept;
  void forget(Index place) noexcept;
  void enter(const ElasticBody& body, Index place) noexcept;
  void follow(const ElasticBody& body, Index place, Index surface_node) noexcept;
  void move(Index from, Index to) noexcept;
  void connect(const ElasticBody& body, Index place) noexcept { connect(body, place, place + 1); }
  void connect(const ElasticBody& body, Index place, Index count) noexcept;
  void connect_by_members(Index place, Index count) noexcept;
  void connect_to_group(Index group, const double* by, double* block) const noexcept;
  void connect_within_patch(Index place) noexcept;
  void connect_beside_patch(const ElasticBody& body, Index place) noexcept;
  void add_local(const LocalCompliance& local, Index place) noexcept;
  void respond(const ElasticBody& body, Index place) noexcept;
  void respond_within(Index place) noexcept;
  [[nodiscard]] const double* compliance_row(Index place, Index axis) noexcept;
  void find_offset(Index place) noexcept;
  void spread(std::span<const double> forces) noexcept;
  void load_followed(Index place, const Vec3& f) noexcept;
  void load_patch(Index place) noexcept;
  template <class Visit>
  void for_each_stored_force(Visit&& visit) const noexcept;
  [[nodiscard]] Index longest_unwanted() const noexcept;
  [[nodiscard]] bool is_loaded(Index place) const noexcept;
  [[nodiscard]] Index patch_place(Index place) const noexcept { return place_in_patch(node(place)); }
  /// Row [d g] of X or Y of a dof.
  [[nodiscard]] double* X(Index dof) noexcept {
    return beside_.X.data() + std::ptrdiff_t{dof} * beside_.stride;
  }
  [[nodiscard]] double* Y(Index dof) noexcept {
    return beside_.Y.data() + std::ptrdiff_t{dof} * beside_.stride;
  }
  [[nodiscard]] std::ptrdiff_t patch_dofs() const noexcept {
    return dimension_ * std::ssize(load_.patch->stored_nodes());
  }

  static std::size_t at(Index i) noexcept { return static_cast<std::size_t>(i); }

  /// Members of groups, up to `most_members_` at each place.
  struct Members {
    std::vector<Index> count;          // [capacity]
    std::vector<Index> node;           // [members x capacity] surface nodes
    std::vector<double> weight;        // [members x capacity] weights of the group's nodes
    std::vector<Eigen::Matrix3d> map;  // [members x capacity] weights of the group's nodes
  };
  /// Coupling of places beside the patch with the patch.
  struct BesidePatch {
    Index room = 0;  // for nodes of a patch
    std::ptrdiff_t stride = 0;
    std::vector<Index> place_in_patch;  // [S + groups]
    LargeVector<double> X, Y;           // [d capacity x stride] X and M X; Y of a place in the patch: H
    std::vector<double> force;          // [d room] on Q
  };
  /// Blocks of a node that comes.
  struct Work {
    std::vector<double> blocks;       // [d x d capacity] its block row of C
    std::vector<double> by_followed;  // [d x d followed] its displacement by forces on stored nodes
    std::vector<double> gathered;     // [d x d patch room]
    std::vector<double> fine_row;     // [d most_nodes]
    std::vector<double> local;        // [3 x 3 capacity] its local compliance before it turned
  };

  int dimension_;
  Index capacity_;
  Index surface_nodes_;  // S
  Index most_members_;
  Index count_ = 0;
  std::ptrdiff_t stride_;
  std::int64_t tick_ = 0;
  std::int64_t revision_ = 0;
  Index added_blocks_ = 0;
  std::vector<Index> place_;          // [S + groups]
  std::vector<Index> nodes_;          // [capacity] surface nodes
  std::vector<std::int64_t> wanted_;  // [capacity] last tick in which each was wanted
  LargeVector<double> C_;             // [d capacity x stride]
  std::vector<double> force_;         // [d capacity]
  std::vector<double> last_force_;    // [d capacity] before `unload`
  std::vector<double> displacement_;  // [d capacity]
  std::vector<double> begun_;         // [d capacity] displacement at the beginning of the tick
  std::vector<double> last_motion_;   // [d capacity]
  std::vector<double> offset_;        // [d capacity] displacement without forces
  FollowedNodes followed_;            // by places beside the patch
  Members members_;
  BesidePatch beside_;
  Work work_;
  LocalPoints local_points_;  // [capacity] with no shares for groups
  SurfaceLoad load_;
};

}  // namespace palpate
