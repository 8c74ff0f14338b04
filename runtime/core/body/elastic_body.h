// The elastic body as a tick reads it.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/vectors.h"
#include "matrices/newmark.h"
#include "runtime/core/body/aggregates.h"
#include "runtime/core/body/greens.h"
#include "runtime/core/body/node_runs.h"

namespace palpate {

struct CoarseNodes;
class LocalCompliance;

/// Response of the body to contact forces.
enum class ContactModel : std::uint8_t {
  quasi_static,  ///< stiffness alone: Xi
  dynamic,       ///< with inertia and viscosity: K_bar^-1 of one time step (theory.md section 5)
  live,          ///< live body: compliance of one of its steps, each several ticks long
  two_level,     ///< Xi turned with a coarse body, whose balance is found beside the tick
};

/// Free surface node nearest to a point.
struct NearestNode {
  Index node;       ///< stored node
  double distance;  ///< [m]
};

/// Stored nodes that a surface node follows outside overlays: its displacement is the sum of their
/// displacements times the weights. Empty if it is held along every axis.
struct SurfaceParts {
  std::span<const Index> stored;  ///< ascending
  std::span<const double> weights;
};

/// Time integration of a body that swings once it is let go.
struct Swing {
  DynamicsMethod method = DynamicsMethod::none;
  Newmark newmark;
  Rayleigh damping;
};

/// Parts of an ElasticBody. Stored nodes are those of the Green's functions, surface nodes those of
/// the surface that tools meet; the S surface nodes begin with the B that are nodes of the body.
struct BodyParts {
  std::string name;                      ///< for errors
  std::shared_ptr<const Greens> greens;  ///< of the static body; with dynamic contact K_bar^-1
  ContactModel contact_model = ContactModel::quasi_static;
  std::shared_ptr<const Modes> modes{};  ///< null unless the dynamics are modal
  Swing swing{};
  std::shared_ptr<const CoarseNodes> coarse{};  ///< of a body on two levels; null for others
  int refinement = 1;                           ///< r: the surface is that of elements cut into r^d
  std::vector<Index> simplices{};  ///< [F * d] surface nodes of triangles (in the plane, of lines), outward
  std::vector<double> friction{};  ///< [F] Coulomb's coefficient
  std::vector<Vec3> rest{};        ///< [S] positions without a tool [m]
  std::vector<Index> surface_stored{};  ///< [B] stored nodes; -1 where held along every axis
  std::vector<Index> free{};            ///< stored nodes on the surface that are free along every axis
  std::vector<Index> first_part = {0};  ///< [S + 1] of each surface node in the next two
  std::vector<Index> part_stored{};     ///< stored nodes that it follows, ascending
  std::vector<double> part_weight{};    ///< SurfaceParts::weights
};

/// The constant side of a tick: the body's Green's functions as the tick wants them, its surface, and
/// look-ups. The body rests in the displacement that its loads give it; what a tool does comes on top. Shared
/// by threads. Knows neither mesh nor file.
class ElasticBody {
 public:
  /// Throws Error when no surface node is free, as then nothing can be touched.
  explicit ElasticBody(BodyParts parts);

  /// For errors.
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  /// Green's functions of the static body; for dynamic contact K_bar^-1.
  [[nodiscard]] const Greens& greens() const noexcept { return *greens_; }
  [[nodiscard]] const std::shared_ptr<const Greens>& shared_greens() const noexcept { return greens_; }
  [[nodiscard]] ContactModel contact_model() const noexcept { return contact_model_; }
  /// The body's own compliance close to a contact; null: the mesh's.
  [[nodiscard]] const std::shared_ptr<const LocalCompliance>& local() const noexcept { return local_; }
  /// Coarse field of a body on two levels; null for others.
  [[nodiscard]] const std::shared_ptr<const CoarseNodes>& coarse() const noexcept { return coarse_; }
  /// Null unless the dynamics are modal.
  [[nodiscard]] const Modes* modes() const noexcept { return modes_.get(); }

  [[nodiscard]] const Swing& swing() const noexcept { return swing_; }
  /// True if it swings once it is released.
  [[nodiscard]] bool swings() const noexcept { return swing_.method != DynamicsMethod::none; }

  /// Numbers that describe a motion: displacement of the stored dofs, then of the coarse field [n + n_q].
  [[nodiscard]] std::int64_t motion_size() const noexcept;

  /// d, dofs per node: 2 in the plane, 3 in space.
  [[nodiscard]] int dimension() const noexcept { return greens_->dimension(); }

  /// Stored surface nodes that are free along every axis, in the order of their mesh nodes.
  [[nodiscard]] const std::vector<Index>& free_surface_nodes() const noexcept { return surface_; }

  /// Free surface node with the rest position nearest to `point` [m], which must be finite. In the plane the
  /// point's z is ignored.
  [[nodiscard]] NearestNode nearest_surface_node(const Vec3& point) const noexcept;

  [[nodiscard]] int refinement() const noexcept { return refinement_; }  ///< refinement r of the surface
  /// Longest edge of the surface at rest [m]: each point of the surface is at most that far from a surface
  /// node.
  [[nodiscard]] double longest_surface_edge() const noexcept { return longest_surface_edge_; }
  /// Mean edge length of the surface at rest [m].
  [[nodiscard]] double mean_surface_edge() const noexcept { return mean_surface_edge_; }

  /// Bounding box of the surface at rest [m].
  [[nodiscard]] const Eigen::AlignedBox3d& bounds() const noexcept { return bounds_; }

  /// Contact surface, with its own numbering of all nodes on it, held ones included; the body's own nodes
  /// come first.
  /// [F * d] surface nodes of its simplices (triangles, in the plane lines), oriented outward as in
  /// Model::surface.
  [[nodiscard]] std::span<const Index> simplices() const noexcept { return simplices_; }
  /// [surface nodes of the body] their stored nodes, -1 for those that are held along every axis.
  [[nodiscard]] std::span<const Index> surface_stored_nodes() const noexcept { return surface_stored_nodes_; }
  /// Stored nodes that a surface node follows.
  [[nodiscard]] SurfaceParts surface_parts(Index node) const noexcept {
    const auto first = static_cast<std::size_t>(first_part_[node]);
    const auto count = static_cast<std::size_t>(first_part_[static_cast<std::size_t>(node) + 1]) - first;
    return {{part_stored_.data() + first, count}, {part_weight_.data() + first, count}};
  }
  /// True if a surface node can move along some axis.
  [[nodiscard]] bool surface_moves(Index node) const noexcept { return !surface_parts(node).stored.empty(); }
  /// Largest number of stored nodes followed by a surface node.
  [[nodiscard]] Index most_surface_parts() const noexcept { return most_surface_parts_; }
  /// Groups of neighbouring surface nodes; none on a refined surface, which is for overlays.
  [[nodiscard]] const SurfaceAggregates& aggregates() const noexcept { return aggregates_; }
  /// Runs of stored nodes in which the far surface is updated.
  [[nodiscard]] const NodeRuns& runs() const noexcept { return runs_; }
  /// Node number of a group: groups are numbered after all surface nodes.
  [[nodiscard]] Index aggregate_node(Index group) const noexcept {
    return static_cast<Index>(surface_rest_.size()) + group;
  }
  /// Group with a node number; -1 for the number of a surface node.
  [[nodiscard]] Index aggregate_of(Index node) const noexcept {
    return std::max<Index>(node - static_cast<Index>(surface_rest_.size()), -1);
  }
  /// Surface nodes whose last part is `stored`: once it is known, so are all nodes that they follow.
  [[nodiscard]] std::span<const Index> followers(Index stored) const noexcept {
    const auto first = static_cast<std::size_t>(first_follower_[stored]);
    const auto end = static_cast<std::size_t>(first_follower_[static_cast<std::size_t>(stored) + 1]);
    return {followers_.data() + first, end - first};
  }
  /// Surface node of a stored node; -1 if it is inside the body.
  [[nodiscard]] Index surface_node_of_stored(Index stored) const noexcept {
    return surface_node_of_stored_[stored];
  }
  /// [S] positions at rest [m].
  [[nodiscard]] std::span<const Vec3> surface_rest_positions() const noexcept { return surface_rest_; }
  /// [F] Coulomb coefficient of each simplex, from its element's material.
  [[nodiscard]] std::span<const double> surface_friction() const noexcept { return surface_friction_; }
  /// [F] mean edge length of each simplex at rest [m].
  [[nodiscard]] std::span<const double> simplex_edges() const noexcept { return simplex_edges_; }

 protected:
  void take_local(std::shared_ptr<const LocalCompliance> local) { local_ = std::move(local); }

 private:
  void find_free_nodes(const std::vector<Index>& free);
  void find_followers();
  void measure_surface();

  std::string name_;
  std::shared_ptr<const Greens> greens_;
  ContactModel contact_model_;
  std::shared_ptr<const Modes> modes_;
  Swing swing_;
  std::shared_ptr<const CoarseNodes> coarse_;
  int refinement_;
  std::vector<Index> simplices_;               // [F * d]
  std::vector<double> surface_friction_;       // [F]
  std::vector<Vec3> surface_rest_;             // [S]
  std::vector<Index> surface_stored_nodes_;    // [surface nodes of the body]
  std::vector<Index> surface_node_of_stored_;  // [stored]
  std::vector<Index> first_part_;              // [S + 1]
  std::vector<Index> part_stored_;
  std::vector<double> part_weight_;
  Index most_surface_parts_ = 1;
  std::vector<Index> first_follower_;  // [stored + 1]
  std::vector<Index> followers_;       // surface nodes
  std::vector<Index> surface_;         // free surface nodes
  std::vector<double> x_, y_, z_;      // [free surface nodes, padded with infinity] rest positions
  SurfaceAggregates aggregates_;
  NodeRuns runs_;
  std::vector<double> simplex_edges_;  // [F]
  double longest_surface_edge_ = 0.0;
  double mean_surface_edge_ = 0.0;
  Eigen::AlignedBox3d bounds_;
  std::shared_ptr<const LocalCompliance> local_;
};

}  // namespace palpate
