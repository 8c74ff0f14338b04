// Static condensation of a patch's fine mesh onto the body's nodes and its own surface.
#pragma once

#include "formats/condensed_patch.h"
#include "overlay/patch_mesh.h"

namespace palpate {

/// Condenses a patch: eliminates its free local dofs layer by layer of nodes, from the deepest to the
/// surface; a layer shares elements with adjacent layers only. Throws Error if K_L is not positive definite.
CondensedPatch condense(const Model& model, const PatchMesh& patch);

}  // namespace palpate
