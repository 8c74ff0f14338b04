// Boundary of a mesh.
#pragma once

#include <span>

#include "meshes/mesh.h"

namespace palpate {

/// Facets that belong to exactly one element, oriented outwards, and the nodes on them.
struct Surface {
  ElementType facet = ElementType::tri3;  ///< kind of the facets: line2 in the plane
  std::vector<Index> facets;              ///< [F * nodes per facet] mesh node numbers; outward normal by the
                                          ///< right-hand rule, in the plane to the right of the line from
                                          ///< node 0 to 1
  std::vector<Index> nodes;               ///< [S] mesh node numbers on the boundary, ascending

  [[nodiscard]] Index count() const noexcept {
    return static_cast<Index>(facets.size() / static_cast<std::size_t>(traits(facet).nodes));
  }
  [[nodiscard]] std::span<const Index> facet_nodes(Index f) const noexcept {
    const auto width = static_cast<std::size_t>(traits(facet).nodes);
    return {facets.data() + width * static_cast<std::size_t>(f), width};
  }
};

/// Extracts the boundary. Expects positively oriented elements; throws Error if more than two elements share
/// a facet, or two are on the same side of it.
Surface extract_surface(const Mesh& mesh);

/// The surface as linear simplices: triangles in space (a quad4 facet is cut into two, a tri6 into four at
/// its middle nodes), lines in the plane. [simplices * d] mesh node numbers, oriented as the facets.
std::vector<Index> surface_simplices(const Surface& surface);

/// The nodes on a surface, numbered from 0.
struct SurfaceNumbering {
  std::vector<Index> mesh_nodes;  ///< [S] mesh node of each, ascending
  std::vector<Index> simplices;   ///< [F * d] the surface's simplices in this numbering, order kept
};

/// Numbers the nodes of `simplices` [F * d], which are nodes of a mesh of `mesh_nodes`.
SurfaceNumbering number_surface(std::span<const Index> simplices, std::size_t mesh_nodes);

/// For each mesh node, the smallest number of elements between it and the surface: 0 on the surface, 1 for
/// nodes that share an element with a surface node, and so on. [N]
std::vector<Index> layers_below_surface(const Mesh& mesh, const Surface& surface);

}  // namespace palpate
