// Fine mesh of an overlay that is finest where a tool touches: graded, round and quadratic.
#pragma once

#include <array>
#include <vector>

#include "overlay/patch_mesh.h"
#include "overlay/rounding.h"

namespace palpate {

/// Place at which a patch is finest.
struct PatchFocus {
  std::vector<Vec3> points;  ///< on the flat surface of the mesh [m]
  double edge;               ///< longest edge there [m]; at a distance r from all points max(edge, r)
};

/// Facet of a graded mesh on the body's surface.
struct GradedFacet {
  std::array<Index, 3> corners;  ///< of the body's facet that contains it, as many as the dimension
  std::array<Vec3, 3> weights;   ///< of its own corners: weights of those
  std::array<Index, 6> nodes;    ///< local nodes: its corners, then the middles of 01, 12, 20
};

/// A patch whose fine mesh is graded.
struct GradedMesh {
  PatchMesh mesh;  ///< `local` consists of tet10 or tri6, `node_of_key` is empty
  std::vector<GradedFacet> facets;
};

/// Cuts elements of a mesh of simplices: bisects edges that are too long for their place, the longest of the
/// elements round them first (Rivara 1984), and gives all a node in the middle of each edge. Nodes on
/// the body's surface are moved onto `rounding`, or stay on flat facets if an element would turn over. Throws
/// Error if the elements are no simplices, or if there are none.
GradedMesh make_graded_mesh(const Model& model, const ElementsAtNodes& at, const Rounding& rounding,
                            std::vector<Index> elements, const PatchFocus& focus);

}  // namespace palpate
