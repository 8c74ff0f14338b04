// A patch's fine mesh, condensed onto the body's nodes and its own surface.
#pragma once

#include "formats/condensed_patch.h"
#include "overlay/patch_mesh.h"

namespace palpate {

/// Eliminates the free local dofs layer by layer of nodes, from the deepest to the surface: a layer has
/// common elements with the next ones only. Throws Error when K_L is not positive definite.
CondensedPatch condense(const Model& model, const PatchMesh& patch);

}  // namespace palpate
