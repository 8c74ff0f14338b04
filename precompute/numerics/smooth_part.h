// What neighbouring columns of an inverse have in common.
#pragma once

#include <cstdint>
#include <span>

#include "formats/packed.h"
#include "precompute/numerics/factor.h"

namespace palpate {

/// W [n x terms] of A = R + W W^T, A = K^-1 at the stored dofs, with a remainder R that is positive definite
/// and as small as `terms` vectors leave it, in units of D^-1, D the diagonal of K: a stiff part of the body
/// counts as much as a soft one. Terms in descending order; the first of them do for a smaller W. By subspace
/// iteration on D^1/2 A D^1/2 from a fixed start and Nystroem's formula, some (3 terms) solves. `factor`: of
/// K, computed. `stored_dofs`: dof of K of each, -1 where it is held (a row of zeros).
SmoothPart smooth_part(const Factor& factor, const SparseMatrix& K, std::span<const std::int64_t> stored_dofs,
                       std::int64_t terms);

/// The first `terms` columns of W.
SmoothPart first_terms(const SmoothPart& smooth, std::int64_t terms);

}  // namespace palpate
