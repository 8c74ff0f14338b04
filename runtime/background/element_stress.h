// Stress in the interior, where all displacements are known.
#pragma once

#include "formats/model.h"
#include "runtime/background/stress_rows.h"

namespace palpate {

/// sigma = D (B u - eps_0) of the elements at each node of the mesh by the displacement u0 + u of all of
/// them: the mean over the elements at the node, weighted by their volumes (theory.md section 6).
StressRows element_stress(const Model& model);

}  // namespace palpate
