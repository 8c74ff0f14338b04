// Which dofs' rows and columns of Xi are kept.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/model.h"
#include "meshes/surface.h"
#include "precompute/numerics/assembly.h"

namespace palpate {

/// A mark for each dof of K: 1 where its row and column of Xi are kept (theory.md section 2).
std::vector<std::uint8_t> stored_dof_marks(const Mesh& mesh, const Surface& surface,
                                           const Stiffness& stiffness, Scope scope, Index layers);

}  // namespace palpate
