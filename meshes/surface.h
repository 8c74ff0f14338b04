// Boundary of a tetrahedral mesh.
#pragma once

#include "meshes/mesh.h"

namespace palpate {

/// Faces that belong to exactly one tetrahedron, oriented outwards, and the nodes on them.
struct Surface {
  std::vector<Triangle> triangles;  ///< [F] mesh node numbers, outward normal by the right-hand rule
  std::vector<Index> nodes;         ///< [S] mesh node numbers on the boundary, ascending
};

/// Extracts the boundary. Expects positively oriented elements; throws Error where more than two elements
/// share a face, or two are on the same side of it.
Surface extract_surface(const Mesh& mesh);

/// For each mesh node, the smallest number of elements between it and the surface: 0 on the surface, 1 for
/// nodes that share an element with a surface node, and so on. [N]
std::vector<Index> layers_below_surface(const Mesh& mesh, const Surface& surface);

}  // namespace palpate
