#include "runtime/body.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "meshes/error.h"
#include "runtime/surface_numbering.h"

namespace palpate {
namespace {

constexpr std::size_t search_block = 64;
constexpr double infinity = std::numeric_limits<double>::infinity();

void check_sizes(const Model& model) {
  const std::size_t nodes = model.mesh.nodes.size();
  const auto in_mesh = [nodes](Index node) { return node >= 0 && static_cast<std::size_t>(node) < nodes; };
  if (model.greens.order() != model.stored_dofs() ||
      !std::all_of(model.stored_nodes.begin(), model.stored_nodes.end(), in_mesh)) {
    throw Error("the Green's functions of " + std::to_string(model.greens.order()) +
                    " dofs do not belong to the " + std::to_string(model.stored_nodes.size()) +
                    " stored nodes of a mesh of " + std::to_string(nodes),
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

Greens take_greens(Model& model, const GreensOptions& options) {
  check_sizes(model);
  return Greens(std::exchange(model.greens, {}), model.dimension(), options);
}

}  // namespace

Body::Body(Model model, const GreensOptions& options)
    : model_(std::move(model)), greens_(take_greens(model_, options)) {
  std::vector<Vec3> rest = model_.mesh.nodes;
  for (std::size_t node = 0; node < rest.size(); ++node) rest[node] += model_.rest_displacement[node];
  stored_of_mesh_.assign(rest.size(), -1);
  for (std::size_t k = 0; k < model_.stored_nodes.size(); ++k) {
    stored_of_mesh_[static_cast<std::size_t>(model_.stored_nodes[k])] = static_cast<Index>(k);
  }

  SurfaceNumbering numbering = number_surface(model_.surface, rest.size());
  surface_mesh_nodes_ = std::move(numbering.mesh_nodes);
  surface_node_of_stored_.assign(model_.stored_nodes.size(), -1);
  simplices_ = std::move(numbering.simplices);
  for (const Index mesh_node : surface_mesh_nodes_) {
    const auto node = static_cast<std::size_t>(mesh_node);
    surface_stored_nodes_.push_back(stored_of_mesh_[node]);
    if (stored_of_mesh_[node] >= 0)
      surface_node_of_stored_[static_cast<std::size_t>(stored_of_mesh_[node])] =
          static_cast<Index>(surface_rest_.size());
    surface_rest_.push_back(rest[node]);
    if (stored_of_mesh_[node] < 0 || model_.fixed[node] != 0) continue;
    surface_.push_back(stored_of_mesh_[node]);
    x_.push_back(rest[node].x());
    y_.push_back(rest[node].y());
    z_.push_back(rest[node].z());
  }
  if (surface_.empty()) {
    throw Error("no node of the surface is free to move, so nothing can be touched", model_.name,
                "fix a smaller region of the body and precompute the model again");
  }
  for (const Index element : surface_elements(model_)) {
    const Index material = model_.material_of_element[static_cast<std::size_t>(element)];
    surface_friction_.push_back(model_.materials[static_cast<std::size_t>(material)].friction);
  }
  measure_surface();
  const std::size_t padded = (surface_.size() + search_block - 1) / search_block * search_block;
  for (std::vector<double>* coordinate : {&x_, &y_, &z_}) coordinate->resize(padded, infinity);
}

void Body::measure_surface() {
  for (const Vec3& position : surface_rest_) bounds_.extend(position);
  const auto corners = static_cast<std::size_t>(dimension());
  double sum = 0.0;
  for (std::size_t simplex = 0; simplex < simplices_.size(); simplex += corners) {
    for (std::size_t k = 0; k < corners; ++k) {
      const auto a = static_cast<std::size_t>(simplices_[simplex + k]);
      const auto b = static_cast<std::size_t>(simplices_[simplex + (k + 1) % corners]);
      const double length = (surface_rest_[a] - surface_rest_[b]).norm();
      longest_surface_edge_ = std::max(longest_surface_edge_, length);
      sum += length;  // a closed surface has each edge as often
    }
  }
  mean_surface_edge_ = sum / static_cast<double>(simplices_.size());
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
