// Generated bodies.
#pragma once

#include <array>

#include "meshes/mesh.h"

namespace palpate {

/// Box [origin, origin + size] of cells[0] x cells[1] x cells[2] cells, six Kuhn tetrahedra each
/// (Freudenthal), nodes numbered x fastest.
struct BoxShape {
  Vec3 origin = Vec3::Zero();
  Vec3 size = Vec3::Ones();
  std::array<int, 3> cells = {1, 1, 1};
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

Mesh generate(const BoxShape& shape);
Mesh generate(const CylinderShape& shape);  ///< a square grid bent to the circle, Kuhn tetrahedra
Mesh generate(const SphereShape& shape);    ///< a cubic grid bent to the sphere, Kuhn tetrahedra

}  // namespace palpate
