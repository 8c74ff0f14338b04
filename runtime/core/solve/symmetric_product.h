// Products with a small symmetric matrix in single precision.
#pragma once

#include <cstddef>

namespace palpate {

/// Symmetric matrix, row-major: `rows` x `rows`, each row `stride` long and zero from `rows` to `columns`, a
/// multiple of 8. Products read each entry on and right of the diagonal once, since beyond some hundred rows
/// the matrix exceeds the L1 cache.
struct SymmetricRows {
  const float* entries;
  std::ptrdiff_t stride;
  std::ptrdiff_t rows;
  std::ptrdiff_t columns;
};

/// y = A x; both [columns], x zero from `rows` on.
void multiply(const SymmetricRows& A, const float* x, float* y) noexcept;

/// Y = A X for three vectors at distance `apart`; A is read once.
void multiply_three(const SymmetricRows& A, const float* x, float* y, std::ptrdiff_t apart) noexcept;

}  // namespace palpate
