// How many eigenvalues of a symmetric matrix are negative.
#pragma once

#include <cstdint>

#include "precompute/numerics/factor.h"

namespace palpate {

/// Negative pivots of P A P^T = L D L^T, which are as many as A has negative eigenvalues (Sylvester's law of
/// inertia), by dense fronts over the supernodes (Duff and Reid 1983), without pivoting. A: a lower triangle
/// in the pattern of the K that is `analysed`. L is not kept. Throws Error where a pivot is zero.
std::int64_t negative_pivots(const Factor& analysed, const SparseMatrix& A);

/// Bytes that the fronts take at most, all at once.
std::int64_t inertia_bytes(const Factor& analysed);

}  // namespace palpate
