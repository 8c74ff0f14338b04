// Stress in the interior of a body with known displacements.
#pragma once

#include "formats/model.h"
#include "runtime/background/stress_rows.h"

namespace palpate {

/// Returns the stress sigma = D (B u - eps_0) of the elements at each mesh node for the displacement u0 + u
/// of all nodes: the mean over the elements at the node, weighted by volume (theory.md section 6).
StressRows element_stress(const Model& model);

}  // namespace palpate
