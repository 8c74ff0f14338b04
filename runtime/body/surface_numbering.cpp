#include "runtime/body/surface_numbering.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <limits>

#include "base/error.h"
#include "meshes/surface.h"
#include "meshes/topology.h"

namespace palpate {
namespace {

/// Simplex, independent of the order of its nodes.
struct OwnedSimplex {
  std::array<Index, 3> nodes;  ///< ascending; unused ones of a line are the largest Index
  Index element;

  bool operator<(const OwnedSimplex& other) const { return nodes < other.nodes; }
};

OwnedSimplex owned(std::span<const Index> nodes, Index element) {
  OwnedSimplex simplex{{}, element};
  simplex.nodes.fill(std::numeric_limits<Index>::max());
  std::copy(nodes.begin(), nodes.end(), simplex.nodes.begin());
  std::sort(simplex.nodes.begin(), simplex.nodes.end());
  return simplex;
}

/// Returns the simplices of all facets that belong to one element only, sorted.
std::vector<OwnedSimplex> boundary_simplices(const Mesh& mesh) {
  Surface boundary;
  boundary.facet = traits(mesh.element).facet;
  std::vector<Index> elements;  // element of each facet
  const std::vector<ElementSide> sides = sorted_sides(mesh);
  for (auto side = sides.begin(); side != sides.end();) {
    const auto end =
        std::find_if(side, sides.end(), [&](const ElementSide& s) { return s.corners != side->corners; });
    if (end - side == 1) {
      const std::vector<Index> nodes = side_nodes(mesh, *side);
      boundary.facets.insert(boundary.facets.end(), nodes.begin(), nodes.end());
      elements.push_back(side->element);
    }
    side = end;
  }

  const std::vector<Index> nodes = surface_simplices(boundary);
  const auto d = static_cast<std::size_t>(mesh.dimension());
  std::vector<OwnedSimplex> simplices;
  for (std::size_t at = 0; at < nodes.size(); at += d) {
    const std::size_t facet = at * elements.size() / nodes.size();  // each facet is divided into equally many
    simplices.push_back(owned(std::span(nodes).subspan(at, d), elements[facet]));
  }
  std::sort(simplices.begin(), simplices.end());
  return simplices;
}

}  // namespace

std::vector<Index> surface_elements(const Model& model) {
  const std::vector<OwnedSimplex> boundary = boundary_simplices(model.mesh);
  const auto d = static_cast<std::size_t>(model.dimension());
  std::vector<Index> elements;
  elements.reserve(model.surface.size() / d);
  for (std::size_t at = 0; at < model.surface.size(); at += d) {
    const auto nodes = std::span(model.surface).subspan(at, d);
    const auto [first, last] = std::equal_range(boundary.begin(), boundary.end(), owned(nodes, -1));
    if (first == last) {
      throw Error(
          fmt::format("the surface's {} of nodes {} lies on no side that belongs to exactly one element",
                      d == 3 ? "triangle" : "line", fmt::join(nodes, ", ")),
          model.name, "precompute the model again");
    }
    elements.push_back(first->element);
  }
  return elements;
}

}  // namespace palpate
