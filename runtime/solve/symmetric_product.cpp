#include "runtime/solve/symmetric_product.h"

#include <algorithm>

#include "runtime/solve/vector_loops.h"

namespace palpate {
namespace {

constexpr std::ptrdiff_t block = 8;  // rows that are done together, and a register's floats

/// y += a square of the diagonal times x: its rows are its columns.
void add_diagonal_block(const float* __restrict a, std::ptrdiff_t stride, const float* __restrict x,
                        float* __restrict y) noexcept {
  for (std::ptrdiff_t i = 0; i < block; ++i) {
#pragma omp simd
    for (std::ptrdiff_t k = 0; k < block; ++k) y[k] += a[i * stride + k] * x[i];
  }
}

/// y of four rows beginning at `i` += their entries from `begin` on, times x; and y there += their transpose.
void add_four_rows(const float* __restrict a, std::ptrdiff_t stride, const float* __restrict x,
                   float* __restrict y, std::ptrdiff_t i, std::ptrdiff_t begin, std::ptrdiff_t end) noexcept {
  const float x0 = x[i], x1 = x[i + 1], x2 = x[i + 2], x3 = x[i + 3];
  float s0 = 0.0F, s1 = 0.0F, s2 = 0.0F, s3 = 0.0F;
#pragma omp simd reduction(+ : s0, s1, s2, s3)
  for (std::ptrdiff_t k = begin; k < end; ++k) {
    const float a0 = a[k], a1 = a[stride + k], a2 = a[2 * stride + k], a3 = a[3 * stride + k];
    s0 += a0 * x[k];
    s1 += a1 * x[k];
    s2 += a2 * x[k];
    s3 += a3 * x[k];
    y[k] += a0 * x0 + a1 * x1 + a2 * x2 + a3 * x3;
  }
  y[i] += s0;
  y[i + 1] += s1;
  y[i + 2] += s2;
  y[i + 3] += s3;
}

/// As add_four_rows, of two rows and three vectors.
void add_two_rows(const float* __restrict a, std::ptrdiff_t stride, const float* __restrict x,
                  float* __restrict y, std::ptrdiff_t apart, std::ptrdiff_t i, std::ptrdiff_t begin,
                  std::ptrdiff_t end) noexcept {
  const float* __restrict xb = x + apart;
  const float* __restrict xc = x + 2 * apart;
  float* __restrict yb = y + apart;
  float* __restrict yc = y + 2 * apart;
  const float p0 = x[i], p1 = x[i + 1], q0 = xb[i], q1 = xb[i + 1], r0 = xc[i], r1 = xc[i + 1];
  float s0 = 0.0F, s1 = 0.0F, t0 = 0.0F, t1 = 0.0F, u0 = 0.0F, u1 = 0.0F;
#pragma omp simd reduction(+ : s0, s1, t0, t1, u0, u1)
  for (std::ptrdiff_t k = begin; k < end; ++k) {
    const float a0 = a[k], a1 = a[stride + k];
    s0 += a0 * x[k];
    s1 += a1 * x[k];
    t0 += a0 * xb[k];
    t1 += a1 * xb[k];
    u0 += a0 * xc[k];
    u1 += a1 * xc[k];
    y[k] += a0 * p0 + a1 * p1;
    yb[k] += a0 * q0 + a1 * q1;
    yc[k] += a0 * r0 + a1 * r1;
  }
  y[i] += s0;
  y[i + 1] += s1;
  yb[i] += t0;
  yb[i + 1] += t1;
  yc[i] += u0;
  yc[i + 1] += u1;
}

/// The rows from `begin` on, fewer than a block: beyond them there is nothing.
void add_last_rows(const SymmetricRows& A, std::ptrdiff_t begin, const float* x, float* y) noexcept {
  for (std::ptrdiff_t i = begin; i < A.rows; ++i)
    add(A.entries + i * A.stride + begin, x[i], y + begin, A.columns - begin);
}

}  // namespace

void multiply(const SymmetricRows& A, const float* x, float* y) noexcept {
  std::fill_n(y, A.columns, 0.0F);
  std::ptrdiff_t i = 0;
  for (; i + block <= A.rows; i += block) {
    const float* a = A.entries + i * A.stride;
    add_diagonal_block(a + i, A.stride, x + i, y + i);
    add_four_rows(a, A.stride, x, y, i, i + block, A.columns);
    add_four_rows(a + 4 * A.stride, A.stride, x, y, i + 4, i + block, A.columns);
  }
  add_last_rows(A, i, x, y);
}

void multiply_three(const SymmetricRows& A, const float* x, float* y, std::ptrdiff_t apart) noexcept {
  for (std::ptrdiff_t s = 0; s < 3; ++s) std::fill_n(y + s * apart, A.columns, 0.0F);
  std::ptrdiff_t i = 0;
  for (; i + block <= A.rows; i += block) {
    const float* a = A.entries + i * A.stride;
    for (std::ptrdiff_t s = 0; s < 3; ++s)
      add_diagonal_block(a + i, A.stride, x + s * apart + i, y + s * apart + i);
    for (std::ptrdiff_t j = 0; j < block; j += 2)
      add_two_rows(a + j * A.stride, A.stride, x, y, apart, i + j, i + block, A.columns);
  }
  for (std::ptrdiff_t s = 0; s < 3; ++s) add_last_rows(A, i, x + s * apart, y + s * apart);
}

}  // namespace palpate
