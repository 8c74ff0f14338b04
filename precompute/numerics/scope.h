// Dofs whose rows and columns of Xi are stored.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/model.h"
#include "meshes/surface.h"
#include "precompute/numerics/assembly.h"

namespace palpate {

/// Marks of the dofs of K: 1 if row and column of Xi are stored (theory.md section 2).
std::vector<std::uint8_t> stored_dof_marks(const Mesh& mesh, const Surface& surface,
                                           const Stiffness& stiffness, Scope scope, Index layers);

}  // namespace palpate
