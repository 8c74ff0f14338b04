#include "runtime/core/solve/symmetric_product.h"

#include <algorithm>
#include <cstring>

#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

constexpr std::ptrdiff_t block = 8;  // rows of a square on the diagonal
#ifdef __AVX__
constexpr std::ptrdiff_t lanes = 8;
#else
constexpr std::ptrdiff_t lanes = 4;
#endif
using Lanes [[gnu::vector_size(lanes * sizeof(float))]] = float;
using Four [[gnu::vector_size(4 * sizeof(float))]] = float;

Lanes load(const float* from) noexcept {
  Lanes value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

void store(Lanes value, float* to) noexcept {
  std::memcpy(to, &value, sizeof value);
}

/// Four lanes, each with the total.
#ifdef __AVX__
Four folded(Lanes value) noexcept {
  return __builtin_shufflevector(value, value, 0, 1, 2, 3) +
         __builtin_shufflevector(value, value, 4, 5, 6, 7);
}
#else
Four folded(Lanes value) noexcept {
  return value;
}
#endif

/// Sums of products along four rows, lane by lane.
struct Sums {
  Lanes first{}, second{}, third{}, fourth{};
};

/// Totals of the lanes of each of the four.
Four totals(const Sums& of) noexcept {
  const Four a = folded(of.first), b = folded(of.second), c = folded(of.third), d = folded(of.fourth);
  const Four ab = __builtin_shufflevector(a, b, 0, 1, 4, 5) + __builtin_shufflevector(a, b, 2, 3, 6, 7);
  const Four cd = __builtin_shufflevector(c, d, 0, 1, 4, 5) + __builtin_shufflevector(c, d, 2, 3, 6, 7);
  return __builtin_shufflevector(ab, cd, 0, 2, 4, 6) + __builtin_shufflevector(ab, cd, 1, 3, 5, 7);
}

/// y += a square on the diagonal times x: its rows are also its columns.
void add_diagonal_block(const float* __restrict a, std::ptrdiff_t stride, const float* __restrict x,
                        float* __restrict y) noexcept {
  for (std::ptrdiff_t i = 0; i < block; ++i) {
#pragma omp simd
    for (std::ptrdiff_t k = 0; k < block; ++k) y[k] += a[i * stride + k] * x[i];
  }
}

/// y of four rows starting at `i` += their entries from `begin` on, times x; and y += their transpose. Two
/// runs of columns are summed concurrently, as the sum of one would wait for itself. The next four rows are
/// prefetched: rows are too short for the hardware prefetcher.
void add_four_rows(const float* __restrict a, std::ptrdiff_t stride, const float* __restrict x,
                   float* __restrict y, std::ptrdiff_t i, std::ptrdiff_t begin, std::ptrdiff_t end) noexcept {
  const float x0 = x[i], x1 = x[i + 1], x2 = x[i + 2], x3 = x[i + 3];
  const auto add_row = [](const float* row, Lanes xk, float by, Lanes& sum, Lanes& yk) {
    const Lanes ak = load(row);
    sum += ak * xk;
    yk += ak * by;
  };
  const auto add = [=](std::ptrdiff_t k, Sums& sums) {
    const Lanes xk = load(x + k);
    Lanes yk = load(y + k);
    add_row(a + k, xk, x0, sums.first, yk);
    add_row(a + stride + k, xk, x1, sums.second, yk);
    add_row(a + 2 * stride + k, xk, x2, sums.third, yk);
    add_row(a + 3 * stride + k, xk, x3, sums.fourth, yk);
    store(yk, y + k);
  };
  Sums even, odd;
  std::ptrdiff_t k = begin;
  for (; k + 2 * lanes <= end; k += 2 * lanes) {
    for (std::ptrdiff_t j = 4; j < 8; ++j) __builtin_prefetch(a + j * stride + k);
    add(k, even);
    add(k + lanes, odd);
  }
  for (; k < end; k += lanes) add(k, even);
  const Four sums = totals(even) + totals(odd);
  for (int j = 0; j < 4; ++j) y[i + j] += sums[j];
}

/// Does the same as add_four_rows, for two rows and three vectors.
void add_two_rows(const float* __restrict a, std::ptrdiff_t stride, const float* __restrict x,
                  float* __restrict y, std::ptrdiff_t apart, std::ptrdiff_t i, std::ptrdiff_t begin,
                  std::ptrdiff_t end) noexcept {
  const float* __restrict xb = x + apart;
  const float* __restrict xc = x + 2 * apart;
  float* __restrict yb = y + apart;
  float* __restrict yc = y + 2 * apart;
  const float p0 = x[i], p1 = x[i + 1], q0 = xb[i], q1 = xb[i + 1], r0 = xc[i], r1 = xc[i + 1];
  Sums s, t;
  for (std::ptrdiff_t k = begin; k < end; k += lanes) {
    const Lanes a0 = load(a + k), a1 = load(a + stride + k);
    const Lanes xk = load(x + k), xbk = load(xb + k), xck = load(xc + k);
    s.first += a0 * xk;
    s.second += a1 * xk;
    s.third += a0 * xbk;
    s.fourth += a1 * xbk;
    t.first += a0 * xck;
    t.second += a1 * xck;
    store(load(y + k) + a0 * p0 + a1 * p1, y + k);
    store(load(yb + k) + a0 * q0 + a1 * q1, yb + k);
    store(load(yc + k) + a0 * r0 + a1 * r1, yc + k);
  }
  const Four of_both = totals(s), of_third = totals(t);
  y[i] += of_both[0];
  y[i + 1] += of_both[1];
  yb[i] += of_both[2];
  yb[i + 1] += of_both[3];
  yc[i] += of_third[0];
  yc[i + 1] += of_third[1];
}

/// Adds the rows from `begin` on, fewer than a block and the last ones.
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
