// The same body with other loads or of another stiffness, by linearity: nothing is solved anew.
#pragma once

#include "formats/model.h"

namespace palpate {

/// All loads times `scale`, 0 or more: forces, prescribed displacements and initial strains, and with them
/// u0.
void scale_loads(Model& model, double scale);

/// Young's modulus of all materials times `scale`, above 0: Xi and what forces do to it divided by it,
/// angular frequencies times its root; Rayleigh's C = a M + b K with the same a and b. The Green's functions
/// are scaled when they are read, not copied. Throws Error where the displacement at rest cannot be told, as
/// some of it comes of forces and some of prescribed displacements or initial strains, and for packed
/// dynamics.
void scale_stiffness(Model& model, double scale);

}  // namespace palpate
