// Nested subdivision of elements.
#pragma once

#include <array>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// One element cut into r^d of its own kind. A node is known by whole-number weights of the element's
/// corners, so that neighbours find the nodes of a common side by them.
struct Subdivision {
  struct Node {
    std::array<int, 8> weights;  ///< of the corners, 0 for those that have no part in it
    Vec3 xi;                     ///< in the reference element
  };
  int denominator;  ///< sum of the weights
  std::vector<Node> nodes;
  std::vector<Index>
      connectivity;  ///< [r^d * nodes an element] positions in `nodes`; oriented as the element
  /// [sides of the element] facets that the parts have on each, in the order of element_sides and oriented as
  /// it: [facets * nodes a facet] positions in `nodes`.
  std::vector<std::vector<Index>> sides;
};

/// Subdivides a body element. Triangles and tetrahedra by edgewise subdivision (Edelsbrunner & Grayson 2000),
/// with the corners in the order that `order` gives (each corner's rank, e.g. by node number): neighbours
/// that rank common corners alike fit together, and on a Kuhn mesh numbered x fastest the result is the finer
/// Kuhn mesh. `order` is not used for quad4 and hex8, whose reference cell is cut into r^d. Throws Error
/// unless r >= 1.
Subdivision subdivide(ElementType type, int r, const std::array<int, 4>& order = {0, 1, 2, 3});

}  // namespace palpate
