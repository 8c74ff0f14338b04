// Springs along the edges of a mesh, which replace its elements.
#pragma once

#include <span>
#include <vector>

#include "meshes/material.h"
#include "meshes/mesh.h"

namespace palpate {

/// A spring between two nodes.
struct Spring {
  Index a, b;
  double stiffness;  ///< force per extension [N/m]
  double length;     ///< at rest [m]
};

/// One spring per edge of a mesh of tri3 or tet4, fitted to Young's modulus as by Van Gelder (1998): k = E
/// sum V_e / L^2 over the elements at the edge, with V_e their volume (in the plane area times `thickness`
/// [m]). Over all springs sum k L^2 is 6 E V in space and 3 E V in the plane, which gives an isotropic
/// network Young's modulus E. Its Poisson's ratio is 1/4 in space and 1/3 in the plane, whatever the
/// material's: central forces allow no other. `material_of_element` [E]. Throws Error for other elements.
std::vector<Spring> fitted_springs(const Mesh& mesh, std::span<const Material> materials,
                                   std::span<const Index> material_of_element, double thickness);

}  // namespace palpate
