#include "runtime/capacitance.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "formats/packed.h"
#include "meshes/error.h"

namespace palpate {
namespace {

/// Smallest pivot, relative to the diagonal of C, that is taken for more than rounding.
constexpr double pivot_tolerance = 1e-10;

/// y -= L2 x for the part of L below a 3x3 diagonal block: three columns of L, one right-hand side.
void subtract_columns(const double* __restrict L0, const double* __restrict L1, const double* __restrict L2,
                      const double* x, double* __restrict y, std::int64_t count) noexcept {
  const double x0 = x[0];
  const double x1 = x[1];
  const double x2 = x[2];
#pragma omp simd
  for (std::int64_t i = 0; i < count; ++i) y[i] -= L0[i] * x0 + L1[i] * x1 + L2[i] * x2;
}

double dot(const double* __restrict a, const double* __restrict b, std::int64_t count) noexcept {
  double sum = 0.0;
#pragma omp simd reduction(+ : sum)
  for (std::int64_t i = 0; i < count; ++i) sum += a[i] * b[i];
  return sum;
}

/// Givens rotation of the column pair (L, w) that keeps L L^T + w w^T and zeroes w at the top.
void rotate_in(double* __restrict L, double* __restrict w, std::int64_t count) noexcept {
  const double r = std::hypot(L[0], w[0]);
  const double c = L[0] / r;
  const double s = w[0] / r;
#pragma omp simd
  for (std::int64_t i = 0; i < count; ++i) {
    const double l = L[i];
    L[i] = c * l + s * w[i];
    w[i] = c * w[i] - s * l;
  }
}

}  // namespace

CapacitanceMatrix::CapacitanceMatrix(Index max_nodes) : capacity_(3 * std::int64_t{max_nodes}) {
  if (max_nodes < 1) {
    throw Error("room for " + std::to_string(max_nodes) + " held nodes was asked for", "CapacitanceMatrix",
                "ask for room for at least one");
  }
  L_.resize(static_cast<std::size_t>(packed_size(capacity_)));
  rows_.resize(static_cast<std::size_t>(3 * capacity_));
}

double* CapacitanceMatrix::column(std::int64_t j) noexcept {
  return L_.data() + packed_column(j, capacity_);
}
const double* CapacitanceMatrix::column(std::int64_t j) const noexcept {
  return L_.data() + packed_column(j, capacity_);
}

CapacitanceStatus CapacitanceMatrix::add(std::span<const double> blocks) noexcept {
  const std::int64_t m = 3 * std::int64_t{nodes_};
  if (m == capacity_) return CapacitanceStatus::full;

  // New rows of L: [Y S] with L Y^T = C_old,new and S S^T = C_new,new - Y Y^T.
  double* Y[3];
  for (std::int64_t p = 0; p < 3; ++p) {
    Y[p] = rows_.data() + p * capacity_;
    std::copy_n(blocks.data() + p * (m + 3), m + 3, Y[p]);
  }
  for (std::int64_t j = 0; j < m; j += 3) {
    const double* L0 = column(j);
    const double* L1 = column(j + 1);
    const double* L2 = column(j + 2);
    for (double* y : Y) {
      y[j] /= L0[0];
      y[j + 1] = (y[j + 1] - L0[1] * y[j]) / L1[0];
      y[j + 2] = (y[j + 2] - L0[2] * y[j] - L1[1] * y[j + 1]) / L2[0];
      subtract_columns(L0 + 3, L1 + 2, L2 + 1, y + j, y + j + 3, m - j - 3);
    }
  }
  for (std::int64_t p = 0; p < 3; ++p) {
    for (std::int64_t q = 0; q <= p; ++q) {
      const double rest = Y[p][m + q] - dot(Y[p], Y[q], m + q);
      if (q < p) {
        Y[p][m + q] = rest / Y[q][m + q];
      } else if (rest > pivot_tolerance * Y[p][m + p] && std::isfinite(rest)) {
        Y[p][m + p] = std::sqrt(rest);
      } else {
        return CapacitanceStatus::not_positive_definite;
      }
    }
  }

  for (std::int64_t j = 0; j < m + 3; ++j) {
    double* below = column(j) - j;
    for (std::int64_t p = std::max<std::int64_t>(0, j - m); p < 3; ++p) below[m + p] = Y[p][j];
  }
  ++nodes_;
  return CapacitanceStatus::ok;
}

void CapacitanceMatrix::remove(Index k) noexcept {
  const std::int64_t m = 3 * std::int64_t{nodes_};
  const std::int64_t gone = 3 * std::int64_t{k};
  const std::int64_t rest = m - gone - 3;

  // What the dropped columns carried of the later rows, W, must go into these rows' own factor: L' L'^T = L
  // L^T + W W^T.
  double* W[3];
  for (std::int64_t p = 0; p < 3; ++p) {
    W[p] = rows_.data() + p * capacity_;
    std::copy_n(column(gone + p) + 3 - p, rest, W[p]);
  }
  for (std::int64_t j = 0; j < gone; ++j) {
    double* below = column(j) + gone - j;
    std::copy(below + 3, below + 3 + rest, below);
  }
  for (std::int64_t j = 0; j < rest; ++j) {
    const double* from = column(gone + 3 + j);
    double* to = column(gone + j);
    std::copy(from, from + rest - j, to);
    for (double* w : W) rotate_in(to, w + j, rest - j);
  }
  --nodes_;
}

void CapacitanceMatrix::solve(std::span<double> x) const noexcept {
  const std::int64_t m = 3 * std::int64_t{nodes_};
  for (std::int64_t j = 0; j < m; j += 3) {
    const double* L0 = column(j);
    const double* L1 = column(j + 1);
    const double* L2 = column(j + 2);
    double* y = x.data() + j;
    y[0] /= L0[0];
    y[1] = (y[1] - L0[1] * y[0]) / L1[0];
    y[2] = (y[2] - L0[2] * y[0] - L1[1] * y[1]) / L2[0];
    subtract_columns(L0 + 3, L1 + 2, L2 + 1, y, y + 3, m - j - 3);
  }
  for (std::int64_t j = m; j-- > 0;) {
    const double* L = column(j);
    double* y = x.data() + j;
    y[0] = (y[0] - dot(L + 1, y + 1, m - j - 1)) / L[0];
  }
}

}  // namespace palpate
