// Static condensation of a patch's fine mesh onto the body's nodes and its own surface.
#pragma once

#include "formats/condensed_patch.h"
#include "overlay/patch_layers.h"
#include "overlay/patch_mesh.h"

namespace palpate {

/// Condenses a patch: eliminates its free local dofs layer by layer of nodes, from the deepest to the
/// surface; a layer shares elements with adjacent layers only. If the fine mesh is not nested,
///   G = K_P - (K_GG - K_GL K_L^-1 K_LG)
/// with K_P the stiffness of the elements in whose place it is. `work` is memory to work in. Throws Error if
/// K_L is not positive definite.
CondensedPatch condense(const Model& model, const PatchMesh& patch, LayeredStiffness& work);
CondensedPatch condense(const Model& model, const PatchMesh& patch);

}  // namespace palpate
