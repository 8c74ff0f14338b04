// Loads, and the rest state under them.
#pragma once

#include <vector>

#include "precompute/numerics/assembly.h"
#include "precompute/numerics/factor.h"
#include "precompute/numerics/meshed_body.h"

namespace palpate {

/// Nodal forces of all loads [N] N on every mesh node: nodal forces, tractions and gravity as described, and
/// the initial strains of the materials, integral of t B^T D eps_0 (Fagerholt eq. 3.25-3.30; theory.md
/// section 1). Throws Error for a traction whose selection contains no whole facet of the boundary.
std::vector<Vec3> nodal_loads(const Description& description, const MeshedBody& body);

/// u0 [N] of every mesh node [m]: K u0 = loads on the free dofs, held ones as prescribed.
std::vector<Vec3> rest_displacement(const Factor& factor, const Stiffness& stiffness,
                                    const std::vector<Vec3>& loads, const std::vector<Vec3>& prescribed,
                                    int dimension);

}  // namespace palpate
