#include "runtime/body.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "meshes/error.h"

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

  std::vector<bool> on_surface(rest.size(), false);
  const auto corners = static_cast<std::size_t>(dimension());
  for (std::size_t simplex = 0; simplex < model_.surface.size(); simplex += corners) {
    for (std::size_t k = 0; k < corners; ++k) {
      const auto a = static_cast<std::size_t>(model_.surface[simplex + k]);
      const auto b = static_cast<std::size_t>(model_.surface[simplex + (k + 1) % corners]);
      on_surface[a] = true;
      longest_surface_edge_ = std::max(longest_surface_edge_, (rest[a] - rest[b]).norm());
    }
  }
  for (std::size_t node = 0; node < rest.size(); ++node) {
    if (!on_surface[node] || stored_of_mesh_[node] < 0 || model_.fixed[node] != 0) continue;
    surface_.push_back(stored_of_mesh_[node]);
    x_.push_back(rest[node].x());
    y_.push_back(rest[node].y());
    z_.push_back(rest[node].z());
  }
  if (surface_.empty()) {
    throw Error("no node of the surface is free to move, so nothing can be touched", model_.name,
                "fix a smaller region of the body and precompute the model again");
  }
  const std::size_t padded = (surface_.size() + search_block - 1) / search_block * search_block;
  for (std::vector<double>* coordinate : {&x_, &y_, &z_}) coordinate->resize(padded, infinity);
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
