// Baked model as a body, ready to be touched.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "formats/model.h"
#include "runtime/body/fine_surface.h"
#include "runtime/core/body/elastic_body.h"

namespace palpate {

struct CoarseParts;
struct LiveParts;

/// Coarse body of a body on two levels.
struct DeepParts {
  std::shared_ptr<const CoarseParts> coarse;
  std::shared_ptr<const CoarseNodes> nodes;  ///< of `coarse`
  double step = 0.0;                         ///< time between two balances [s]
};

/// A baked model as an elastic body, and the numbering that links the two: mesh nodes and stored nodes. May
/// be used by any number of threads.
class Body : public ElasticBody {
 public:
  /// Takes over the model and unfolds its Green's functions. The contact surface consists of the elements'
  /// facets, each element divided into r^d for `refinement` r > 1, as in the overlays to be used, on flat
  /// facets. `local`: with a LocalCompliance, if it is even (is_even) and quasi-static, and rounded
  /// (Rounding) if refined. Throws Error if no free surface node is stored, since the body could not be
  /// touched, if the sizes of the model's parts are inconsistent, or for dynamic contact with a model without
  /// dynamics.
  explicit Body(Model model, const GreensOptions& options = {}, int refinement = 1,
                ContactModel contact = ContactModel::quasi_static, bool local = false);
  /// Body on two levels; `deep` comes from the same model.
  Body(Model model, DeepParts deep, int refinement, bool local);
  /// Body that is solved during the touch; `live` comes from `live_model` of the same model.
  Body(Model model, std::shared_ptr<const LiveParts> live, const GreensOptions& options = {});

  /// The baked model except `greens`, which are in greens().
  [[nodiscard]] const Model& model() const noexcept { return model_; }
  /// Solver that runs beside the tick; null if the Green's functions describe the body.
  [[nodiscard]] const LiveParts* live() const noexcept { return live_.get(); }

  /// Coarse body of a body on two levels; null for others.
  [[nodiscard]] const CoarseParts* coarse_parts() const noexcept { return coarse_parts_.get(); }

  /// Stored node of a mesh node; -1 if it is held along every axis or not stored.
  [[nodiscard]] Index stored_node(Index mesh_node) const noexcept { return stored_of_mesh_[mesh_node]; }
  /// Mesh node of a stored node.
  [[nodiscard]] Index mesh_node(Index stored) const noexcept { return model_.stored_nodes[stored]; }
  /// Position of a stored node at rest under the loads, without a tool: node + u0 [m].
  [[nodiscard]] Vec3 rest_position(Index stored) const noexcept {
    const auto node = static_cast<std::size_t>(mesh_node(stored));
    return model_.mesh.nodes[node] + model_.rest_displacement[node];
  }
  /// [surface nodes of the body] mesh nodes, ascending.
  [[nodiscard]] std::span<const Index> surface_mesh_nodes() const noexcept { return fine_.mesh_nodes; }
  /// The refined surface, by which the nodes of overlays on it are found.
  [[nodiscard]] const FineSurface& fine_surface() const noexcept { return fine_; }
  /// Simplices of the surface that is drawn and recorded: with a local compliance the mesh's own, whose nodes
  /// come first, else those that tools meet.
  [[nodiscard]] std::vector<Index> drawn_simplices() const;
  /// [S] positions in the mesh, without loads [m].
  [[nodiscard]] std::vector<Vec3> surface_in_mesh() const;
  /// Position of a surface node on the flat facets of the mesh [m].
  [[nodiscard]] Vec3 flat_position(Index surface_node) const;
  /// Rounding of the refined surface; null: it is flat as the mesh.
  [[nodiscard]] const Rounding* rounding() const noexcept { return rounding_.get(); }

 private:
  [[nodiscard]] std::vector<Index> mesh_simplices() const;

  struct Made;
  static Made make(Model model, const GreensOptions& options, int refinement, ContactModel contact,
                   bool local, const DeepParts& deep = {});
  explicit Body(Made made);

  Model model_;
  std::vector<Index> stored_of_mesh_;  // [N]
  FineSurface fine_;
  std::shared_ptr<const Rounding> rounding_;
  std::shared_ptr<const LiveParts> live_;
  std::shared_ptr<const CoarseParts> coarse_parts_;
};

}  // namespace palpate
