// A loaded body, ready to be touched.
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

/// What a contact force meets.
enum class ContactModel : std::uint8_t {
  quasi_static,  ///< the body's stiffness: Xi
  dynamic,       ///< its inertia and viscosity too: K_bar^-1 of one time step (theory.md section 5)
  live,          ///< a live body's: the compliance of one of its steps, of several ticks
  warped,        ///< Xi turned with the body, which is warped beside the tick
};

/// The free surface node that is nearest to a point.
struct NearestNode {
  Index node;       ///< stored node
  double distance;  ///< [m]
};

/// How a surface node follows the body's nodes where no overlay is: its displacement is the sum of weights
/// times those of stored nodes. Empty where it is held along every axis.
struct SurfaceParts {
  std::span<const Index> stored;  ///< ascending
  std::span<const double> weights;
};

/// The constant side of a tick: the Model, its Green's functions as the tick wants them, and look-ups. The
/// body rests in the displacement u0 that its loads give it; what a tool does comes on top. Shared by
/// threads.
class Body {
 public:
  /// Takes the model over and unfolds its Green's functions. The surface that a tool meets has the sides of
  /// the elements, with `refinement` r > 1 of elements cut into r^d, as the overlays have them that are to be
  /// used. Throws Error when no free surface node is stored, as then nothing can be touched, when the
  /// sizes of the model's parts do not fit together, or for dynamic contact with a model without dynamics.
  explicit Body(Model model, const GreensOptions& options = {}, int refinement = 1,
                ContactModel contact = ContactModel::quasi_static);
  /// A body that is solved while it is touched, by `live_model` of the same parts.
  Body(Model model, std::shared_ptr<const LiveParts> live, const GreensOptions& options = {});

  /// Everything baked, except `greens`, which greens() has taken over.
  [[nodiscard]] const Model& model() const noexcept { return model_; }
  /// Green's functions of the static body; with dynamic contact K_bar^-1.
  [[nodiscard]] const Greens& greens() const noexcept { return greens_; }
  [[nodiscard]] ContactModel contact_model() const noexcept { return contact_model_; }
  /// The solver beside the tick, null for a body that its Green's functions tell all of.
  [[nodiscard]] const LiveParts* live() const noexcept { return live_.get(); }
  /// Null unless the dynamics are modal.
  [[nodiscard]] const Modes* modes() const noexcept { return modes_.get(); }

  /// d, dofs a node: 2 in the plane, 3 in space.
  [[nodiscard]] int dimension() const noexcept { return greens_.dimension(); }

  /// Stored node of a mesh node, -1 when it is held along every axis or not kept.
  [[nodiscard]] Index stored_node(Index mesh_node) const noexcept { return stored_of_mesh_[mesh_node]; }
  /// Mesh node of a stored node.
  [[nodiscard]] Index mesh_node(Index stored) const noexcept { return model_.stored_nodes[stored]; }
  /// Position of a stored node as the body rests under its loads, without a tool: node + u0 [m].
  [[nodiscard]] Vec3 rest_position(Index stored) const noexcept {
    const auto node = static_cast<std::size_t>(mesh_node(stored));
    return model_.mesh.nodes[node] + model_.rest_displacement[node];
  }

  /// Stored nodes on the surface that are free along every axis, in the order of their mesh nodes.
  [[nodiscard]] const std::vector<Index>& free_surface_nodes() const noexcept { return surface_; }

  /// The free surface node whose rest position is nearest to `point` [m], which must be finite. In the plane
  /// the point's z is ignored.
  [[nodiscard]] NearestNode nearest_surface_node(const Vec3& point) const noexcept;

  [[nodiscard]] int refinement() const noexcept { return refinement_; }  ///< r, of the surface
  /// Longest edge of the surface at rest [m]: no point of the surface is farther than that from a surface
  /// node.
  [[nodiscard]] double longest_surface_edge() const noexcept { return longest_surface_edge_; }
  /// Mean length of the edges of the surface at rest [m].
  [[nodiscard]] double mean_surface_edge() const noexcept { return mean_surface_edge_; }

  /// Box around the surface at rest [m].
  [[nodiscard]] const Eigen::AlignedBox3d& bounds() const noexcept { return bounds_; }

  /// The surface that a tool meets, with its own numbering of the nodes on it, held ones too; those of the
  /// body come first:
  /// [F * d] surface nodes of its simplices (triangles, in the plane lines), outward as in Model::surface.
  [[nodiscard]] std::span<const Index> simplices() const noexcept { return fine_.simplices; }
  /// [surface nodes of the body] their mesh nodes, ascending.
  [[nodiscard]] std::span<const Index> surface_mesh_nodes() const noexcept { return fine_.mesh_nodes; }
  /// [the same] their stored nodes, -1 for those that are held along every axis.
  [[nodiscard]] std::span<const Index> surface_stored_nodes() const noexcept { return surface_stored_nodes_; }
  /// How a surface node moves with the body's.
  [[nodiscard]] SurfaceParts surface_parts(Index node) const noexcept {
    const auto first = static_cast<std::size_t>(first_part_[node]);
    const auto count = static_cast<std::size_t>(first_part_[static_cast<std::size_t>(node) + 1]) - first;
    return {{part_stored_.data() + first, count}, {part_weight_.data() + first, count}};
  }
  /// Whether a surface node can move along some axis.
  [[nodiscard]] bool surface_moves(Index node) const noexcept { return !surface_parts(node).stored.empty(); }
  /// Most stored nodes that a surface node follows.
  [[nodiscard]] Index most_surface_parts() const noexcept { return most_surface_parts_; }
  /// Groups of neighbouring surface nodes; none of a refined surface, which is for overlays.
  [[nodiscard]] const SurfaceAggregates& aggregates() const noexcept { return aggregates_; }
  /// Runs of stored nodes by which the far surface is renewed.
  [[nodiscard]] const NodeRuns& runs() const noexcept { return runs_; }
  /// Number of a group among the surface nodes: after all of them.
  [[nodiscard]] Index aggregate_node(Index group) const noexcept {
    return static_cast<Index>(surface_rest_.size()) + group;
  }
  /// Group that a number stands for, -1 where it is a surface node's.
  [[nodiscard]] Index aggregate_of(Index node) const noexcept {
    return std::max<Index>(node - static_cast<Index>(surface_rest_.size()), -1);
  }
  /// Surface nodes whose last part is a stored node: with it, all that they follow are known.
  [[nodiscard]] std::span<const Index> followers(Index stored) const noexcept {
    const auto first = static_cast<std::size_t>(first_follower_[stored]);
    const auto end = static_cast<std::size_t>(first_follower_[static_cast<std::size_t>(stored) + 1]);
    return {followers_.data() + first, end - first};
  }
  /// The surface as it was refined: finds the nodes of overlays on it.
  [[nodiscard]] const FineSurface& fine_surface() const noexcept { return fine_; }
  /// Surface node of a stored node, -1 when it is inside the body.
  [[nodiscard]] Index surface_node_of_stored(Index stored) const noexcept {
    return surface_node_of_stored_[stored];
  }
  /// [S] where each rests [m].
  [[nodiscard]] std::span<const Vec3> surface_rest_positions() const noexcept { return surface_rest_; }
  /// [S] where each is without loads [m]: what the mesh says.
  [[nodiscard]] std::vector<Vec3> surface_in_mesh() const;
  /// [F] Coulomb's coefficient of each simplex: that of the material of its element.
  [[nodiscard]] std::span<const double> surface_friction() const noexcept { return surface_friction_; }
  /// [F] mean length of each simplex's edges at rest [m].
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
  std::vector<double> x_, y_, z_;      // [those, padded to whole blocks with infinity] rest positions
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
