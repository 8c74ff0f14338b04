// Products with a small symmetric matrix in single precision.
#pragma once

#include <cstddef>

namespace palpate {

/// A symmetric matrix by rows: `rows` x `rows`, each row `stride` long and zero from `rows` to `columns`, a
/// multiple of 8. Products read the entries on and right of the diagonal, each once, as beyond some hundred
/// rows the matrix does not fit the cache nearest to the processor.
struct SymmetricRows {
  const float* entries;
  std::ptrdiff_t stride;
  std::ptrdiff_t rows;
  std::ptrdiff_t columns;
};

/// y = A x; both [columns], x zero from `rows` on.
void multiply(const SymmetricRows& A, const float* x, float* y) noexcept;

/// Y = A X of three vectors, `apart` from each other; A is read once.
void multiply_three(const SymmetricRows& A, const float* x, float* y, std::ptrdiff_t apart) noexcept;

}  // namespace palpate
