#include "runtime/body/met_surface.h"

#include <algorithm>
#include <cmath>

#include "meshes/element.h"
#include "runtime/body/fine_surface.h"

namespace palpate {
namespace {

/// Mean edge of the surface [m]; of tet10 half of an element's.
double surface_edge(const Model& model) {
  const auto d = static_cast<std::size_t>(model.dimension());
  double sum = 0.0;
  for (std::size_t s = 0; s < model.surface.size(); s += d)
    sum += (model.mesh.nodes[model.surface[s]] - model.mesh.nodes[model.surface[s + 1]]).norm();
  return sum / static_cast<double>(model.surface.size() / d);
}

}  // namespace

MetSurface met_surface(const Model& model, double radius) {
  constexpr double spacing = 0.15;     // [radius] between the nodes that the tool meets
  constexpr double fine_enough = 0.2;  // [radius] edges
  constexpr double most_nodes = 4e5;   // some 150 bytes each, and a second of loading
  const double edge = surface_edge(model);
  const bool is_of_simplices = traits(model.mesh.element).corners == model.dimension() + 1;
  if (!is_of_simplices || !(edge > fine_enough * radius)) return {};
  const double corners = 0.5 * static_cast<double>(model.surface.size()) / model.dimension();
  const int refinement =
      std::min({std::max(static_cast<int>(std::ceil(edge / (spacing * radius))), least_refinement),
                static_cast<int>(std::sqrt(most_nodes / corners)), most_refinement});
  return refinement > 1 ? MetSurface{.refinement = refinement, .is_local = true} : MetSurface{};
}

}  // namespace palpate
