// How the nodes of an element form its sides and edges.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Local node numbers of a side, as many as its facet has: the corners so that the normal of a positively
/// oriented element looks outwards (right-hand rule; in the plane to the right of the line), then the
/// middles.
using SideNodes = std::array<std::uint8_t, 6>;
using EdgeNodes = std::array<std::uint8_t, 2>;

/// Sides of an element. [facets]
std::span<const SideNodes> element_sides(ElementType type);

/// Corners at the ends of its edges; tri6 and tet10 have their middles in this order. [edges]
std::span<const EdgeNodes> element_edges(ElementType type);

/// Order of the local nodes in which the element has the opposite orientation. [nodes]
std::span<const std::uint8_t> reversed_nodes(ElementType type);

/// One side of one element.
struct ElementSide {
  std::array<Index, 4> corners;  ///< node numbers, ascending; beyond the side's corners the largest Index
  Index element;
  std::uint8_t side;
};

/// All sides of all elements, those with the same corners next to each other (in the order of the corners,
/// then of the elements). [E * facets]
std::vector<ElementSide> sorted_sides(const Mesh& mesh);

/// Sides that belong to one element only: the boundary. In the order of the elements, then of their sides.
std::vector<ElementSide> boundary_sides(const Mesh& mesh);

/// Node numbers of the side, in the order of element_sides. [nodes of a facet]
std::vector<Index> side_nodes(const Mesh& mesh, const ElementSide& side);

}  // namespace palpate
