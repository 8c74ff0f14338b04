#include "meshes/surface.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>

#include "base/error.h"
#include "meshes/topology.h"

namespace palpate {
namespace {

constexpr const char* remove_overlap = "Remove the elements that overlap or stand twice in the mesh";

/// Text for a side: "face of nodes 3, 7, 9".
std::string text(const Mesh& mesh, const ElementSide& side) {
  const auto corners = static_cast<std::ptrdiff_t>(traits(traits(mesh.element).facet).corners);
  return fmt::format("{} of nodes {}", mesh.dimension() == 3 ? "face" : "side",
                     fmt::join(side.corners.begin(), side.corners.begin() + corners, ", "));
}

/// Throws Error unless two elements that share the corners of a side lie on both sides of it and share its
/// middles.
void check_pair(const Mesh& mesh, const ElementSide& one, const ElementSide& other) {
  std::vector<Index> a = side_nodes(mesh, one), b = side_nodes(mesh, other);
  const auto corners = static_cast<std::ptrdiff_t>(traits(traits(mesh.element).facet).corners);
  const auto a_middles = a.begin() + corners, b_middles = b.begin() + corners;
  std::reverse(b.begin(), b_middles);
  if (corners > 2) std::rotate(b.begin(), std::find(b.begin(), b_middles, a.front()), b_middles);
  if (!std::equal(a.begin(), a_middles, b.begin())) {
    throw Error(fmt::format("two elements overlap: they are on the same side of the {}", text(mesh, one)),
                "mesh", remove_overlap);
  }
  std::sort(a_middles, a.end());
  std::sort(b_middles, b.end());
  if (a != b) {
    throw Error(fmt::format("two elements share the {} but not the middles of its edges", text(mesh, one)),
                "mesh", "Join the nodes that are at the same place");
  }
}

}  // namespace

Surface extract_surface(const Mesh& mesh) {
  const std::vector<ElementSide> sides = sorted_sides(mesh);
  Surface surface;
  surface.facet = traits(mesh.element).facet;
  for (auto side = sides.begin(); side != sides.end();) {
    const auto end =
        std::find_if(side, sides.end(), [&](const ElementSide& s) { return s.corners != side->corners; });
    if (end - side > 2) {
      throw Error(fmt::format("{} elements share the {}", end - side, text(mesh, *side)), "mesh",
                  remove_overlap);
    }
    if (end - side == 2) check_pair(mesh, side[0], side[1]);
    if (end - side == 1) {
      const std::vector<Index> nodes = side_nodes(mesh, *side);
      surface.facets.insert(surface.facets.end(), nodes.begin(), nodes.end());
    }
    side = end;
  }
  surface.nodes = surface.facets;
  std::sort(surface.nodes.begin(), surface.nodes.end());
  surface.nodes.erase(std::unique(surface.nodes.begin(), surface.nodes.end()), surface.nodes.end());
  return surface;
}

std::vector<Index> surface_simplices(const Surface& surface) {
  using Cut = std::array<std::size_t, 3>;
  static constexpr std::array<Cut, 2> quad_cuts = {{{0, 1, 2}, {0, 2, 3}}};
  static constexpr std::array<Cut, 4> tri6_cuts = {{{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}}};
  if (surface.facet == ElementType::line2 || surface.facet == ElementType::tri3) return surface.facets;
  const std::span<const Cut> cuts =
      surface.facet == ElementType::quad4 ? std::span<const Cut>(quad_cuts) : std::span<const Cut>(tri6_cuts);
  std::vector<Index> triangles;
  triangles.reserve(3 * cuts.size() * static_cast<std::size_t>(surface.count()));
  for (Index f = 0; f < surface.count(); ++f) {
    for (const Cut& cut : cuts) {
      for (const std::size_t node : cut) triangles.push_back(surface.facet_nodes(f)[node]);
    }
  }
  return triangles;
}

SurfaceNumbering number_surface(std::span<const Index> simplices, std::size_t mesh_nodes) {
  std::vector<Index> number(mesh_nodes, -1);
  for (const Index node : simplices) number[static_cast<std::size_t>(node)] = 0;
  SurfaceNumbering result;
  for (std::size_t node = 0; node < mesh_nodes; ++node) {
    if (number[node] < 0) continue;
    number[node] = static_cast<Index>(result.mesh_nodes.size());
    result.mesh_nodes.push_back(static_cast<Index>(node));
  }
  result.simplices.reserve(simplices.size());
  for (const Index node : simplices) result.simplices.push_back(number[static_cast<std::size_t>(node)]);
  return result;
}

std::vector<Index> layers_below_surface(const Mesh& mesh, const Surface& surface) {
  constexpr Index unreached = std::numeric_limits<Index>::max();
  std::vector<Index> layer(mesh.nodes.size(), unreached);
  for (const Index node : surface.nodes) layer[static_cast<std::size_t>(node)] = 0;
  bool changed = true;
  for (Index depth = 0; changed; ++depth) {
    changed = false;
    for (Index e = 0; e < mesh.elements(); ++e) {
      const std::span<const Index> nodes = mesh.element_nodes(e);
      const bool touches = std::any_of(nodes.begin(), nodes.end(), [&](Index node) {
        return layer[static_cast<std::size_t>(node)] == depth;
      });
      if (!touches) continue;
      for (const Index node : nodes) {
        Index& l = layer[static_cast<std::size_t>(node)];
        if (l != unreached) continue;
        l = depth + 1;
        changed = true;
      }
    }
  }
  return layer;
}

}  // namespace palpate
