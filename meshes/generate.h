// Generated bodies.
#pragma once

#include <array>

#include "meshes/mesh.h"

namespace palpate {

/// Box [origin, origin + size] of cells[0] x cells[1] x cells[2] cells, nodes numbered x fastest.
struct BoxShape {
  Vec3 origin = Vec3::Zero();
  Vec3 size = Vec3::Ones();
  std::array<int, 3> cells = {1, 1, 1};
};

/// Rectangle in the plane, nodes numbered x fastest.
struct RectangleShape {
  Vec3 origin = Vec3::Zero();
  Vec3 size = {1.0, 1.0, 0.0};
  std::array<int, 2> cells = {1, 1};
};

/// Cylinder along z from z = 0 to `height`, centred on the z axis.
struct CylinderShape {
  double radius = 1.0;
  double height = 1.0;
  int cells_across = 4;  ///< cells over the diameter, even
  int cells_along = 4;   ///< cells over the height
};

/// Ball about the origin.
struct SphereShape {
  double radius = 1.0;
  int cells_across = 4;  ///< cells over the diameter, even
};

/// Mesh of a box. `element`: tet4 or tet4a (six Kuhn tetrahedra per cell, Freudenthal) or hex8.
Mesh generate(const BoxShape& shape, ElementType element = ElementType::tet4);
/// Mesh of a rectangle. `element`: quad4, or tri3 (each cell cut along its rising diagonal).
Mesh generate(const RectangleShape& shape, ElementType element = ElementType::quad4);
Mesh generate(const CylinderShape& shape);  ///< a square grid bent to the circle, Kuhn tetrahedra
Mesh generate(const SphereShape& shape);    ///< a cubic grid bent to the sphere, Kuhn tetrahedra

/// Mesh of the same body with elements of another kind: tet4 becomes tet10 by a new node in the middle of
/// each edge (numbered after the old ones; straight edges), tet10 becomes tet4 without its middle nodes,
/// tet4a is tet4 by its nodes, a mesh of that kind is returned unchanged. Tagged facets are converted too.
/// Throws Error (where = `where`) for any other pair, naming the mesh's kind.
Mesh with_elements(Mesh mesh, ElementType element, const std::string& where);

}  // namespace palpate
