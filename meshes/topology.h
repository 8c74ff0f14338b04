// Sides and edges of elements by their local nodes.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Local node numbers of a side, as many as its facet has: first the corners, ordered so that the normal of a
/// positively oriented element points outwards (right-hand rule; in the plane to the right of the line), then
/// the middles.
using SideNodes = std::array<std::uint8_t, 6>;
using EdgeNodes = std::array<std::uint8_t, 2>;

/// Sides of an element. [facets]
std::span<const SideNodes> element_sides(ElementType type);

/// Corners at the ends of the edges; tri6 and tet10 have their middle nodes in this order. [edges]
std::span<const EdgeNodes> element_edges(ElementType type);

/// Order of the local nodes that reverses an element's orientation. [nodes]
std::span<const std::uint8_t> reversed_nodes(ElementType type);

/// One side of one element.
struct ElementSide {
  std::array<Index, 4> corners;  ///< node numbers, ascending; beyond the side's corners the largest Index
  Index element;
  std::uint8_t side;
};

/// All sides of all elements, sorted by corners, then by element; sides with the same corners are adjacent.
/// [E * facets]
std::vector<ElementSide> sorted_sides(const Mesh& mesh);

/// Boundary sides, which belong to one element only, in the order of the elements, then of their sides.
std::vector<ElementSide> boundary_sides(const Mesh& mesh);

/// Node numbers of the side, in the order of element_sides. [nodes of a facet]
std::vector<Index> side_nodes(const Mesh& mesh, const ElementSide& side);

}  // namespace palpate
