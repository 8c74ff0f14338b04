// Models with other loads or another stiffness, by linearity and without solving again.
#pragma once

#include "formats/model.h"

namespace palpate {

/// Multiplies all loads by `scale`, at least 0: forces, prescribed displacements and initial strains, and
/// with them u0.
void scale_loads(Model& model, double scale);

/// Multiplies Young's modulus of all materials by `scale`, above 0: Xi and displacements by forces are
/// divided by it, angular frequencies multiplied by its square root; Rayleigh's C = a M + b K keeps a and b.
/// The Green's functions are scaled when read, not copied. Throws Error for packed dynamics, and if the
/// displacement at rest is caused by forces together with prescribed displacements or initial strains, as
/// their parts are unknown.
void scale_stiffness(Model& model, double scale);

}  // namespace palpate
