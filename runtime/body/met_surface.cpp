#include "runtime/body/met_surface.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "meshes/element.h"
#include "runtime/body/fine_surface.h"

namespace palpate {
namespace {

/// Edge that half of the surface's simplices have longer than this [m]: where a mesh is graded most are
/// small. Of tet10 half of an element's.
double surface_edge(const Model& model) {
  const auto d = static_cast<std::size_t>(model.dimension());
  std::vector<double> edges;
  for (std::size_t s = 0; s < model.surface.size(); s += d)
    edges.push_back((model.mesh.nodes[model.surface[s]] - model.mesh.nodes[model.surface[s + 1]]).norm());
  const auto middle = edges.begin() + std::ssize(edges) / 2;
  std::nth_element(edges.begin(), middle, edges.end());
  return *middle;
}

}  // namespace

bool is_even(const Model& model) noexcept {
  const Material& first = model.materials.front();
  return model.dimension() == 3 &&
         std::all_of(model.materials.begin(), model.materials.end(), [&](const Material& material) {
           return material.youngs_modulus == first.youngs_modulus &&
                  material.poissons_ratio == first.poissons_ratio;
         });
}

MetSurface met_surface(const Model& model, double radius, bool has_patches) {
  // [radius] between the nodes that the tool meets: under patches (PatchMaker) they are loaded as points, and
  // too soft where they are few.
  const double spacing = has_patches ? 0.15 : 0.21;
  constexpr double fine_enough = 0.2;  // [radius] edges
  constexpr double most_nodes = 4e5;   // some 150 bytes each, and a second of loading
  const double edge = surface_edge(model);
  if (!(edge > fine_enough * radius)) return {};
  const double corners = 0.5 * static_cast<double>(model.surface.size()) / model.dimension();
  const int refinement =
      std::min({std::max(static_cast<int>(std::ceil(edge / (spacing * radius))), least_refinement),
                static_cast<int>(std::sqrt(most_nodes / corners)), most_refinement});
  return refinement > 1 ? MetSurface{.refinement = refinement, .is_local = true} : MetSurface{};
}

}  // namespace palpate
