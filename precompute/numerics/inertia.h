// Number of negative eigenvalues of a symmetric matrix.
#pragma once

#include <cstdint>

#include "precompute/numerics/factor.h"

namespace palpate {

/// Number of negative pivots of P A P^T = L D L^T, which equals the number of negative eigenvalues of A
/// (Sylvester's law of inertia), by dense fronts over the supernodes (Duff and Reid 1983), without pivoting.
/// A: a lower triangle with the pattern of the K that is `analysed`. L is not kept. Throws Error if a pivot
/// is zero.
std::int64_t negative_pivots(const Factor& analysed, const SparseMatrix& A);

/// Peak size of all fronts together [byte].
std::int64_t inertia_bytes(const Factor& analysed);

}  // namespace palpate
