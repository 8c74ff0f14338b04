#include "runtime/body/body.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

#include "base/error.h"
#include "matrices/hierarchical.h"
#include "meshes/surface.h"
#include "runtime/body/modal_newmark.h"
#include "runtime/body/surface_numbering.h"
#include "runtime/solve/tick_tuning.h"

namespace palpate {
namespace {

constexpr std::size_t search_block = 64;
constexpr double infinity = std::numeric_limits<double>::infinity();

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
Greens take_greens(Model& model, const GreensOptions& options, ContactModel contact) {
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
  if (compressed != nullptr) return Greens(compressed);
  return Greens(std::move(greens), model.dimension(), options);
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

}  // namespace

Body::Body(Model model, const GreensOptions& options, int refinement, ContactModel contact)
    : model_(std::move(model)),
      contact_model_(contact),
      greens_(take_greens(model_, options, contact)),
      refinement_(refinement) {
  if (model_.dynamics.method == DynamicsMethod::modal) {
    modes_ = std::make_shared<const Modes>(model_);
    model_.dynamics.shapes = {};
    if (contact == ContactModel::dynamic)
      greens_.add_modes(*modes_, dynamic_weights(*modes_, model_.dynamics));
  }
  stored_of_mesh_.assign(model_.mesh.nodes.size(), -1);
  for (std::size_t k = 0; k < model_.stored_nodes.size(); ++k) {
    stored_of_mesh_[model_.stored_nodes[k]] = static_cast<Index>(k);
  }
  fine_ = refinement_ > 1 ? make_fine_surface(model_, refinement_) : surface_as_it_is(model_);
  order_by_last_part();
  find_free_nodes();
  follow_body();
  std::vector<bool> moves;
  std::vector<Index> follows;
  for (Index node = 0; node < fine_.nodes(); ++node) {
    const SurfaceParts parts = surface_parts(node);
    moves.push_back(refinement_ == 1 && surface_moves(node));
    follows.push_back(parts.stored.empty() ? -1 : parts.stored.back());
  }
  aggregates_ = SurfaceAggregates(dimension(), simplices(), moves);
  runs_ = NodeRuns(tuning.far.run, greens_.nodes(), dimension(), simplices(), follows);
  for (const Index element : fine_.element) {
    const Index material = model_.material_of_element[element];
    surface_friction_.push_back(model_.materials[material].friction);
  }
  measure_surface();
}

Body::Body(Model model, std::shared_ptr<const LiveParts> live, const GreensOptions& options)
    : Body(std::move(model), options, 1, ContactModel::live) {
  live_ = std::move(live);
}

/// Reorders the surface nodes so that those with the same last part are contiguous in memory: the tick moves
/// them together.
void Body::order_by_last_part() {
  const auto of_body = static_cast<Index>(fine_.mesh_nodes.size());
  std::vector<Index> last;
  for (auto node = static_cast<std::size_t>(of_body); node < static_cast<std::size_t>(fine_.nodes());
       ++node) {
    Index& most = last.emplace_back(-1);
    for (auto k = static_cast<std::size_t>(fine_.first[node]);
         k < static_cast<std::size_t>(fine_.first[node + 1]); ++k)
      most = std::max(most, stored_of_mesh_[fine_.parents[k]]);
  }
  std::vector<Index> order(last.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) { return last[a] < last[b]; });
  reorder(fine_, order);
}

void Body::find_free_nodes() {
  surface_node_of_stored_.assign(model_.stored_nodes.size(), -1);
  for (std::size_t k = 0; k < fine_.mesh_nodes.size(); ++k) {
    const auto node = static_cast<std::size_t>(fine_.mesh_nodes[k]);
    const Index stored = stored_of_mesh_[node];
    surface_stored_nodes_.push_back(stored);
    if (stored >= 0) surface_node_of_stored_[stored] = static_cast<Index>(k);
    if (stored < 0 || model_.fixed[node] != 0) continue;
    const Vec3 rest = rest_position(stored);
    surface_.push_back(stored);
    x_.push_back(rest.x());
    y_.push_back(rest.y());
    z_.push_back(rest.z());
  }
  if (surface_.empty()) {
    throw Error("no node of the surface is free to move, so nothing can be touched", model_.name,
                "fix a smaller region of the body and precompute the model again");
  }
  const std::size_t padded = (surface_.size() + search_block - 1) / search_block * search_block;
  for (std::vector<double>* coordinate : {&x_, &y_, &z_}) coordinate->resize(padded, infinity);
}

void Body::follow_body() {
  first_part_.push_back(0);
  std::vector<Index> last_part;  // [surface nodes] -1 for none
  for (Index node = 0; node < fine_.nodes(); ++node) {
    const auto at = static_cast<std::size_t>(node);
    Vec3 rest = Vec3::Zero();
    std::vector<std::pair<Index, double>> parts;
    for (Index k = fine_.first[at]; k < fine_.first[at + 1]; ++k) {
      const auto parent = static_cast<std::size_t>(fine_.parents[k]);
      const double weight = fine_.weights[k];
      rest += weight * (model_.mesh.nodes[parent] + model_.rest_displacement[parent]);
      if (stored_of_mesh_[parent] >= 0) parts.emplace_back(stored_of_mesh_[parent], weight);
    }
    std::sort(parts.begin(), parts.end());
    for (const auto& [stored, weight] : parts) {
      part_stored_.push_back(stored);
      part_weight_.push_back(weight);
    }
    first_part_.push_back(static_cast<Index>(part_stored_.size()));
    most_surface_parts_ = std::max(most_surface_parts_, static_cast<Index>(parts.size()));
    last_part.push_back(parts.empty() ? -1 : parts.back().first);
    surface_rest_.push_back(rest);
  }
  first_follower_.assign(model_.stored_nodes.size() + 1, 0);
  for (const Index stored : last_part) {
    if (stored >= 0) ++first_follower_[static_cast<std::size_t>(stored) + 1];
  }
  std::partial_sum(first_follower_.begin(), first_follower_.end(), first_follower_.begin());
  followers_.resize(first_follower_.back());
  std::vector<Index> next(first_follower_.begin(), first_follower_.end() - 1);
  for (std::size_t node = 0; node < last_part.size(); ++node) {
    if (last_part[node] < 0) continue;
    Index& place = next[last_part[node]];
    followers_[place++] = static_cast<Index>(node);
  }
}

std::vector<Vec3> Body::surface_in_mesh() const {
  std::vector<Vec3> positions(surface_rest_.size(), Vec3::Zero());
  for (std::size_t node = 0; node < positions.size(); ++node) {
    for (auto k = static_cast<std::size_t>(fine_.first[node]);
         k < static_cast<std::size_t>(fine_.first[node + 1]); ++k) {
      positions[node] += fine_.weights[k] * model_.mesh.nodes[fine_.parents[k]];
    }
  }
  return positions;
}

void Body::measure_surface() {
  for (const Vec3& position : surface_rest_) bounds_.extend(position);
  const auto corners = static_cast<std::size_t>(dimension());
  double sum = 0.0;
  for (std::size_t simplex = 0; simplex < simplices().size(); simplex += corners) {
    double around = 0.0;
    for (std::size_t k = 0; k < corners; ++k) {
      const auto a = static_cast<std::size_t>(simplices()[simplex + k]);
      const auto b = static_cast<std::size_t>(simplices()[simplex + (k + 1) % corners]);
      const double length = (surface_rest_[a] - surface_rest_[b]).norm();
      longest_surface_edge_ = std::max(longest_surface_edge_, length);
      around += length;
      sum += length;  // a closed surface counts each edge equally often
    }
    simplex_edges_.push_back(around / static_cast<double>(corners));
  }
  mean_surface_edge_ = sum / static_cast<double>(simplices().size());
}

NearestNode Body::nearest_surface_node(const Vec3& point) const noexcept {
  const double z = dimension() == 3 ? point.z() : 0.0;
  const auto squared_distance = [&](std::size_t i) {
    const double dx = x_[i] - point.x();
    const double dy = y_[i] - point.y();
    const double dz = z_[i] - z;
    return dx * dx + dy * dy + dz * dz;
  };

  double nearest = infinity;
  std::size_t nearest_block = 0;
  for (std::size_t block = 0; block < x_.size(); block += search_block) {
    double in_block = infinity;
#pragma omp simd reduction(min : in_block)
    for (std::size_t i = block; i < block + search_block; ++i)
      in_block = std::min(in_block, squared_distance(i));
    if (in_block < nearest) {
      nearest = in_block;
      nearest_block = block;
    }
  }

  std::size_t best = nearest_block;
  for (std::size_t i = best; i < std::min(nearest_block + search_block, surface_.size()); ++i) {
    if (squared_distance(i) < squared_distance(best)) best = i;
  }
  return {surface_[best], std::sqrt(squared_distance(best))};
}

}  // namespace palpate
