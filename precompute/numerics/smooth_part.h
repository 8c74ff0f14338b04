// Common part of neighbouring columns of an inverse.
#pragma once

#include <cstdint>
#include <span>

#include "matrices/packed.h"
#include "precompute/numerics/factor.h"

namespace palpate {

/// W [n x terms] of A = R + W W^T, with A = K^-1 at the stored dofs. The remainder R is positive definite and
/// as small as `terms` vectors allow, in units of D^-1, with D the diagonal of K: stiff parts of the body
/// count as much as soft ones. Terms are in descending order; the first of them make a smaller W. By subspace
/// iteration on D^1/2 A D^1/2 from a fixed start and the Nystroem formula, with about 3 `terms` solves.
/// `factor`: of K, computed. `stored_dofs`: dof of K of each, -1 if held (a row of zeros).
SmoothPart smooth_part(const Factor& factor, const SparseMatrix& K, std::span<const std::int64_t> stored_dofs,
                       std::int64_t terms);

/// First `terms` columns of W.
SmoothPart first_terms(const SmoothPart& smooth, std::int64_t terms);

}  // namespace palpate
