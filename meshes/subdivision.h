// Nested subdivision of elements.
#pragma once

#include <array>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// One element cut into r^d of its own kind. A node is identified by integer weights of the element's
/// corners, by which neighbours find the nodes of a common side.
struct Subdivision {
  struct Node {
    std::array<int, 8> weights;  ///< of the corners; 0 for corners that do not contribute
    Vec3 xi;                     ///< reference coordinates
  };
  int denominator;  ///< sum of the weights
  std::vector<Node> nodes;
  std::vector<Index>
      connectivity;  ///< [r^d * nodes per element] positions in `nodes`; oriented as the element
  /// [sides of the element] facets of the parts on each side, in the order of element_sides and oriented as
  /// it: [facets * nodes per facet] positions in `nodes`.
  std::vector<std::vector<Index>> sides;
};

/// Subdivides a body element. Triangles and tetrahedra by edgewise subdivision (Edelsbrunner & Grayson 2000),
/// with the corners in the order given by `order` (the rank of each corner, e.g. by node number): neighbours
/// that rank common corners alike match, and on a Kuhn mesh numbered x fastest the result is the finer Kuhn
/// mesh. `order` is not used for quad4 and hex8, whose reference cell is cut into r^d. Throws Error unless
/// r >= 1.
Subdivision subdivide(ElementType type, int r, const std::array<int, 4>& order = {0, 1, 2, 3});

}  // namespace palpate
