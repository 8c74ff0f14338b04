#include "runtime/body/body.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include "base/error.h"
#include "matrices/hierarchical.h"
#include "meshes/surface.h"
#include "runtime/body/met_surface.h"
#include "runtime/body/surface_numbering.h"
#include "runtime/core/body/local_compliance.h"
#include "runtime/core/body/modal_newmark.h"

namespace palpate {
namespace {

void check_sizes(const Model& model) {
  const std::size_t nodes = model.mesh.nodes.size();
  const auto in_mesh = [nodes](Index node) { return node >= 0 && static_cast<std::size_t>(node) < nodes; };
  const std::int64_t order = model.compressed != nullptr ? model.compressed->order() : model.greens.order();
  if (order != model.stored_dofs() ||
      !std::all_of(model.stored_nodes.begin(), model.stored_nodes.end(), in_mesh)) {
    throw Error("the Green's functions of " + std::to_string(order) + " dofs do not belong to the " +
                    std::to_string(model.stored_nodes.size()) + " stored nodes of a mesh of " +
                    std::to_string(nodes),
                model.name, "precompute the model again");
  }
  const auto check_nodal = [&](const char* what, std::size_t size) {
    if (size == nodes) return;
    throw Error(std::string(what) + " of " + std::to_string(size) + " nodes does not belong to a mesh of " +
                    std::to_string(nodes),
                model.name, "precompute the model again");
  };
  check_nodal("the rest displacement", model.rest_displacement.size());
  check_nodal("the list of held axes", model.fixed.size());
  const auto of_a_material = [&model](Index m) {
    return m >= 0 && static_cast<std::size_t>(m) < model.materials.size();
  };
  if (std::ssize(model.material_of_element) != model.mesh.elements() ||
      !std::all_of(model.material_of_element.begin(), model.material_of_element.end(), of_a_material)) {
    throw Error("the materials of " + std::to_string(model.material_of_element.size()) +
                    " elements do not belong to a mesh of " + std::to_string(model.mesh.elements()) +
                    " elements and " + std::to_string(model.materials.size()) + " materials",
                model.name, "precompute the model again");
  }
}

/// Returns the surface of the elements, not refined.
FineSurface surface_as_it_is(const Model& model) {
  SurfaceNumbering numbering = number_surface(model.surface, model.mesh.nodes.size());
  FineSurface surface;
  surface.simplices = std::move(numbering.simplices);
  surface.element = surface_elements(model);
  surface.mesh_nodes = std::move(numbering.mesh_nodes);
  surface.parents = surface.mesh_nodes;
  surface.weights.assign(surface.parents.size(), 1.0);
  surface.first.resize(surface.parents.size() + 1);
  std::iota(surface.first.begin(), surface.first.end(), 0);
  return surface;
}

/// Takes over the matrix for contact: Xi, or for dynamic contact K_bar^-1, to which modes are yet to be
/// added.
std::shared_ptr<const Greens> take_greens(Model& model, const GreensOptions& options, ContactModel contact) {
  if (model.scope == Scope::none) {
    throw Error(
        "the file has no Green's functions: its scope is none", model.name,
        "palpate-runtime push FILE solves it while you touch it, as play --solver corotational does; or set "
        "another scope in [storage] and precompute it again");
  }
  check_sizes(model);
  PackedGreens greens = std::exchange(model.greens, {});
  const std::shared_ptr<const HierarchicalMatrix> compressed = std::exchange(model.compressed, nullptr);
  if (contact == ContactModel::dynamic) {
    if (model.dynamics.method == DynamicsMethod::none) {
      throw Error("the file has no dynamics, which dynamic contact needs", model.name,
                  "add [dynamics] to its model.toml and precompute it again");
    }
    if (model.dynamics.method == DynamicsMethod::packed) greens = model.dynamics.inverse;
  }
  if (compressed != nullptr) return make_greens(compressed);
  return make_greens(std::move(greens), model.dimension(), options);
}

/// The modes of a model with modal dynamics.
std::shared_ptr<const Modes> make_modes(const Model& model) {
  const auto n = static_cast<std::size_t>(model.stored_dofs());
  const StoredDynamics& dynamics = model.dynamics;
  if (dynamics.modes() < 1 || dynamics.shapes.size() != static_cast<std::size_t>(dynamics.modes()) * n) {
    throw Error("the file has no modes of its " + std::to_string(n) + " stored dofs", model.name,
                "precompute it with [dynamics] and method = \"modal\"");
  }
  if (dynamics.modes() > most_modes) {
    throw Error("the file has " + std::to_string(dynamics.modes()) + " modes", model.name,
                "precompute it with modes = " + std::to_string(most_modes) + " or fewer in [dynamics]");
  }
  return std::make_shared<const Modes>(model.dimension(), dynamics.omega, dynamics.shapes);
}

/// Weights 1 / k_bar_i - 1 / omega_i^2 of the modes.
std::vector<double> dynamic_weights(const Modes& modes, const StoredDynamics& dynamics) {
  const ModalNewmark newmark(modes.omega(), dynamics.damping, dynamics.newmark);
  std::vector<double> weights;
  for (std::size_t i = 0; i < modes.omega().size(); ++i) {
    const double omega = modes.omega()[i];
    weights.push_back(1.0 / newmark.effective_stiffness()[i] - 1.0 / (omega * omega));
  }
  return weights;
}

/// Reorders the surface nodes so that those with the same last part are contiguous in memory: the tick moves
/// them together.
void order_by_last_part(FineSurface& fine, const std::vector<Index>& stored_of_mesh) {
  const auto of_body = static_cast<Index>(fine.mesh_nodes.size());
  std::vector<Index> last;
  for (auto node = static_cast<std::size_t>(of_body); node < static_cast<std::size_t>(fine.nodes()); ++node) {
    Index& most = last.emplace_back(-1);
    for (auto k = static_cast<std::size_t>(fine.first[node]);
         k < static_cast<std::size_t>(fine.first[node + 1]); ++k)
      most = std::max(most, stored_of_mesh[fine.parents[k]]);
  }
  std::vector<Index> order(last.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) { return last[a] < last[b]; });
  reorder(fine, order);
}

/// Enters how the surface follows the body, and where it rests.
void follow_body(const FineSurface& fine, const Model& model, const std::vector<Index>& stored_of_mesh,
                 BodyParts& parts) {
  for (const Index mesh_node : fine.mesh_nodes) {
    const Index stored = stored_of_mesh[mesh_node];
    parts.surface_stored.push_back(stored);
    if (stored >= 0 && model.fixed[mesh_node] == 0) parts.free.push_back(stored);
  }
  for (std::size_t node = 0; node < static_cast<std::size_t>(fine.nodes()); ++node) {
    Vec3 rest = fine.rise.empty() ? Vec3(Vec3::Zero()) : fine.rise[node];
    std::vector<std::pair<Index, double>> of_node;
    for (auto k = static_cast<std::size_t>(fine.first[node]);
         k < static_cast<std::size_t>(fine.first[node + 1]); ++k) {
      const auto parent = static_cast<std::size_t>(fine.parents[k]);
      rest += fine.weights[k] * (model.mesh.nodes[parent] + model.rest_displacement[parent]);
      if (stored_of_mesh[parent] >= 0) of_node.emplace_back(stored_of_mesh[parent], fine.weights[k]);
    }
    std::sort(of_node.begin(), of_node.end());
    for (const auto& [stored, weight] : of_node) {
      parts.part_stored.push_back(stored);
      parts.part_weight.push_back(weight);
    }
    parts.first_part.push_back(static_cast<Index>(parts.part_stored.size()));
    parts.rest.push_back(rest);
  }
}

}  // namespace

struct Body::Made {
  BodyParts parts;
  Model model;
  std::vector<Index> stored_of_mesh;
  FineSurface fine;
  std::shared_ptr<const Rounding> rounding;
  bool is_local;  // else contact meets the mesh's compliance
};

Body::Made Body::make(Model model, const GreensOptions& options, int refinement, ContactModel contact,
                      bool local, const DeepParts& deep) {
  BodyParts parts{.name = model.name,
                  .greens = take_greens(model, options, contact),
                  .contact_model = contact,
                  .swing = {model.dynamics.method, model.dynamics.newmark, model.dynamics.damping},
                  .coarse = deep.nodes,
                  .refinement = refinement};
  if (deep.nodes != nullptr) {
    parts.swing = {.method = DynamicsMethod::packed, .newmark = {.time_step = deep.step}, .damping = {}};
  } else if (model.dynamics.method == DynamicsMethod::modal) {
    parts.modes = make_modes(model);
    model.dynamics.shapes = {};
    if (contact == ContactModel::dynamic)
      parts.greens = with_modes(parts.greens, *parts.modes, dynamic_weights(*parts.modes, model.dynamics));
  }
  std::vector<Index> stored_of_mesh(model.mesh.nodes.size(), -1);
  for (std::size_t k = 0; k < model.stored_nodes.size(); ++k)
    stored_of_mesh[model.stored_nodes[k]] = static_cast<Index>(k);
  std::shared_ptr<const Rounding> rounding;
  if (local && refinement > 1) rounding = std::make_shared<const Rounding>(model.mesh);
  FineSurface fine =
      refinement > 1 ? make_fine_surface(model, refinement, rounding.get()) : surface_as_it_is(model);
  order_by_last_part(fine, stored_of_mesh);
  follow_body(fine, model, stored_of_mesh, parts);
  parts.simplices = fine.simplices;
  for (const Index element : fine.element)
    parts.friction.push_back(model.materials[model.material_of_element[element]].friction);
  const bool is_static = contact == ContactModel::quasi_static || contact == ContactModel::two_level;
  const bool is_local = local && is_even(model) && is_static;
  return {std::move(parts), std::move(model),    std::move(stored_of_mesh),
          std::move(fine),  std::move(rounding), is_local};
}

Body::Body(Made made)
    : ElasticBody(std::move(made.parts)),
      model_(std::move(made.model)),
      stored_of_mesh_(std::move(made.stored_of_mesh)),
      fine_(std::move(made.fine)),
      rounding_(std::move(made.rounding)) {
  if (!made.is_local) return;
  const Material& material = model_.materials.front();
  take_local(std::make_shared<const LocalCompliance>(*this, mesh_simplices(), material.youngs_modulus,
                                                     material.poissons_ratio));
}

Body::Body(Model model, const GreensOptions& options, int refinement, ContactModel contact, bool local)
    : Body(make(std::move(model), options, refinement, contact, local)) {}

Body::Body(Model model, DeepParts deep, int refinement, bool local)
    : Body(make(std::move(model), {}, refinement, ContactModel::two_level, local, deep)) {
  coarse_parts_ = std::move(deep.coarse);
}

Body::Body(Model model, std::shared_ptr<const LiveParts> live, const GreensOptions& options)
    : Body(std::move(model), options, 1, ContactModel::live) {
  live_ = std::move(live);
}

std::vector<Index> Body::mesh_simplices() const {
  return number_surface(model_.surface, model_.mesh.nodes.size()).simplices;
}

std::vector<Index> Body::drawn_simplices() const {
  return local() != nullptr ? mesh_simplices() : std::vector<Index>(simplices().begin(), simplices().end());
}

std::vector<Vec3> Body::surface_in_mesh() const {
  std::vector<Vec3> positions(surface_rest_positions().size(), Vec3::Zero());
  for (std::size_t node = 0; node < positions.size(); ++node) {
    positions[node] = flat_position(static_cast<Index>(node));
    if (!fine_.rise.empty()) positions[node] += fine_.rise[node];
  }
  return positions;
}

Vec3 Body::flat_position(Index surface_node) const {
  const auto node = static_cast<std::size_t>(surface_node);
  Vec3 position = Vec3::Zero();
  for (auto k = static_cast<std::size_t>(fine_.first[node]);
       k < static_cast<std::size_t>(fine_.first[node + 1]); ++k)
    position += fine_.weights[k] * model_.mesh.nodes[fine_.parents[k]];
  return position;
}

}  // namespace palpate
