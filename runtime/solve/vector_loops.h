// Loops over rows of the tick's small matrices. Not Eigen's: its sums depend on how memory is aligned, and
// equal states are to go the same way to the last bit.
#pragma once

#include <cstddef>

namespace palpate {

/// a . b
inline double dot(const double* __restrict a, const double* __restrict b, std::ptrdiff_t count) noexcept {
  double sum = 0.0;
#pragma omp simd reduction(+ : sum)
  for (std::ptrdiff_t i = 0; i < count; ++i) sum += a[i] * b[i];
  return sum;
}

/// y += factor x
inline void add(const double* __restrict x, double factor, double* __restrict y,
                std::ptrdiff_t count) noexcept {
#pragma omp simd
  for (std::ptrdiff_t i = 0; i < count; ++i) y[i] += factor * x[i];
}

/// y -= factor x
inline void subtract(const double* __restrict x, double factor, double* __restrict y,
                     std::ptrdiff_t count) noexcept {
#pragma omp simd
  for (std::ptrdiff_t i = 0; i < count; ++i) y[i] -= factor * x[i];
}

}  // namespace palpate
