// Loops over rows of the tick's small matrices. Eigen is not used: the rounding of its sums depends on memory
// alignment, and equal states must give equal bits.
#pragma once

#include <cstddef>

namespace palpate {

/// a . b.
template <typename Real>
Real dot(const Real* __restrict a, const Real* __restrict b, std::ptrdiff_t count) noexcept {
  Real sum = 0;
#pragma omp simd reduction(+ : sum)
  for (std::ptrdiff_t i = 0; i < count; ++i) sum += a[i] * b[i];
  return sum;
}

/// y += factor x.
template <typename Real>
void add(const Real* __restrict x, Real factor, Real* __restrict y, std::ptrdiff_t count) noexcept {
#pragma omp simd
  for (std::ptrdiff_t i = 0; i < count; ++i) y[i] += factor * x[i];
}

/// y += three rows x at distance `stride`, times their factors: y is read and written once. The three rows
/// after them, usually needed next, are prefetched.
template <typename Real>
void add_three(const Real* __restrict x, std::ptrdiff_t stride, const Real* factors, Real* __restrict y,
               std::ptrdiff_t count) noexcept {
  constexpr auto line = static_cast<std::ptrdiff_t>(64 / sizeof(Real));  // entries per cache line
  const Real f0 = factors[0], f1 = factors[1], f2 = factors[2];
  std::ptrdiff_t begin = 0;
  for (; begin + line <= count; begin += line) {
    for (std::ptrdiff_t row = 3; row < 6; ++row) __builtin_prefetch(x + row * stride + begin);
#pragma omp simd
    for (std::ptrdiff_t i = begin; i < begin + line; ++i)
      y[i] += f0 * x[i] + f1 * x[stride + i] + f2 * x[2 * stride + i];
  }
  for (std::ptrdiff_t i = begin; i < count; ++i)
    y[i] += f0 * x[i] + f1 * x[stride + i] + f2 * x[2 * stride + i];
}

/// y -= factor x.
template <typename Real>
void subtract(const Real* __restrict x, Real factor, Real* __restrict y, std::ptrdiff_t count) noexcept {
#pragma omp simd
  for (std::ptrdiff_t i = 0; i < count; ++i) y[i] -= factor * x[i];
}

}  // namespace palpate
