// Loaded body, ready to be touched.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <memory>
#include <span>
#include <vector>

#include "formats/model.h"
#include "runtime/body/aggregates.h"
#include "runtime/body/fine_surface.h"
#include "runtime/body/greens.h"
#include "runtime/body/node_runs.h"

namespace palpate {

struct LiveParts;

/// Response of the body to contact forces.
enum class ContactModel : std::uint8_t {
  quasi_static,  ///< stiffness alone: Xi
  dynamic,       ///< with inertia and viscosity: K_bar^-1 of one time step (theory.md section 5)
  live,          ///< live body: compliance of one of its steps, each several ticks long
  warped,        ///< Xi rotated with the body, whose warp is computed beside the tick
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

/// Constant input of the tick: the Model, its Green's functions in the tick's form, and look-up tables. The
/// body rests at the displacement u0 caused by its loads; the displacement by tools is added to it. May be
/// used by any number of threads.
class Body {
 public:
  /// Takes over the model and unfolds its Green's functions. The contact surface consists of the elements'
  /// facets, each element divided into r^d for `refinement` r > 1, as in the overlays to be used. Throws
  /// Error if no free surface node is stored, since the body could not be touched, if the sizes of the
  /// model's parts are inconsistent, or for dynamic contact with a model without dynamics.
  explicit Body(Model model, const GreensOptions& options = {}, int refinement = 1,
                ContactModel contact = ContactModel::quasi_static);
  /// Body that is solved during the touch; `live` comes from `live_model` of the same model.
  Body(Model model, std::shared_ptr<const LiveParts> live, const GreensOptions& options = {});

  /// The baked model except `greens`, which are in greens().
  [[nodiscard]] const Model& model() const noexcept { return model_; }
  /// Green's functions of the static body; for dynamic contact K_bar^-1.
  [[nodiscard]] const Greens& greens() const noexcept { return greens_; }
  [[nodiscard]] ContactModel contact_model() const noexcept { return contact_model_; }
  /// Solver that runs beside the tick; null if the Green's functions describe the body.
  [[nodiscard]] const LiveParts* live() const noexcept { return live_.get(); }
  /// Null unless the dynamics are modal.
  [[nodiscard]] const Modes* modes() const noexcept { return modes_.get(); }

  /// d, degrees of freedom per node: 2 in the plane, 3 in space.
  [[nodiscard]] int dimension() const noexcept { return greens_.dimension(); }

  /// Stored node of a mesh node; -1 if it is held along every axis or not stored.
  [[nodiscard]] Index stored_node(Index mesh_node) const noexcept { return stored_of_mesh_[mesh_node]; }
  /// Mesh node of a stored node.
  [[nodiscard]] Index mesh_node(Index stored) const noexcept { return model_.stored_nodes[stored]; }
  /// Position of a stored node at rest under the loads, without a tool: node + u0 [m].
  [[nodiscard]] Vec3 rest_position(Index stored) const noexcept {
    const auto node = static_cast<std::size_t>(mesh_node(stored));
    return model_.mesh.nodes[node] + model_.rest_displacement[node];
  }

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
  [[nodiscard]] std::span<const Index> simplices() const noexcept { return fine_.simplices; }
  /// [surface nodes of the body] mesh nodes, ascending.
  [[nodiscard]] std::span<const Index> surface_mesh_nodes() const noexcept { return fine_.mesh_nodes; }
  /// [surface nodes of the body] stored nodes; -1 for those held along every axis.
  [[nodiscard]] std::span<const Index> surface_stored_nodes() const noexcept { return surface_stored_nodes_; }
  /// Stored nodes that a surface node follows, with their weights.
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
  /// The refined surface, in which the nodes of overlays are looked up.
  [[nodiscard]] const FineSurface& fine_surface() const noexcept { return fine_; }
  /// Surface node of a stored node; -1 if it is inside the body.
  [[nodiscard]] Index surface_node_of_stored(Index stored) const noexcept {
    return surface_node_of_stored_[stored];
  }
  /// [S] positions at rest [m].
  [[nodiscard]] std::span<const Vec3> surface_rest_positions() const noexcept { return surface_rest_; }
  /// [S] positions without loads, as in the mesh [m].
  [[nodiscard]] std::vector<Vec3> surface_in_mesh() const;
  /// [F] Coulomb coefficient of each simplex, from its element's material.
  [[nodiscard]] std::span<const double> surface_friction() const noexcept { return surface_friction_; }
  /// [F] mean edge length of each simplex at rest [m].
  [[nodiscard]] std::span<const double> simplex_edges() const noexcept { return simplex_edges_; }

 private:
  void order_by_last_part();
  void find_free_nodes();
  void follow_body();
  void measure_surface();

  Model model_;
  ContactModel contact_model_;
  Greens greens_;
  std::shared_ptr<const Modes> modes_;
  std::shared_ptr<const LiveParts> live_;
  int refinement_;
  FineSurface fine_;
  std::vector<Index> stored_of_mesh_;  // [N]
  std::vector<Index> surface_;         // free surface nodes
  std::vector<double> x_, y_, z_;      // [free surface nodes, padded with infinity] rest positions
  double longest_surface_edge_ = 0.0;
  double mean_surface_edge_ = 0.0;
  Eigen::AlignedBox3d bounds_;
  std::vector<Index> surface_stored_nodes_;    // [surface nodes of the body]
  std::vector<Index> surface_node_of_stored_;  // [stored]
  std::vector<Index> first_part_;              // [S + 1]
  std::vector<Index> part_stored_;
  std::vector<double> part_weight_;
  Index most_surface_parts_ = 1;
  SurfaceAggregates aggregates_;
  NodeRuns runs_;
  std::vector<Index> first_follower_;     // [stored + 1]
  std::vector<Index> followers_;          // surface nodes
  std::vector<Vec3> surface_rest_;        // [S]
  std::vector<double> surface_friction_;  // [F]
  std::vector<double> simplex_edges_;     // [F]
};

}  // namespace palpate
