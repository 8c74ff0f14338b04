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

/// y -= L x for the part of L below a diagonal block: two or three columns of L, one right-hand side.
void subtract_columns(const double* __restrict L0, const double* __restrict L1, const double* x,
                      double* __restrict y, std::int64_t count) noexcept {
  const double x0 = x[0];
  const double x1 = x[1];
#pragma omp simd
  for (std::int64_t i = 0; i < count; ++i) y[i] -= L0[i] * x0 + L1[i] * x1;
}

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

CapacitanceMatrix::CapacitanceMatrix(int dimension, Index max_nodes)
    : dimension_(dimension), max_nodes_(max_nodes), capacity_(std::int64_t{dimension} * max_nodes) {
  if (max_nodes < 1) {
    throw Error("room for " + std::to_string(max_nodes) + " held nodes was asked for", "CapacitanceMatrix",
                "ask for room for at least one");
  }
  L_.resize(static_cast<std::size_t>(packed_size(capacity_)));
  rows_.resize(static_cast<std::size_t>(dimension_ * capacity_));
}

double* CapacitanceMatrix::column(std::int64_t j) noexcept {
  return L_.data() + packed_column(j, capacity_);
}
const double* CapacitanceMatrix::column(std::int64_t j) const noexcept {
  return L_.data() + packed_column(j, capacity_);
}

/// One node of the forward substitution L y = b: solves for the D entries of y from j on and takes them out
/// of the later ones, of `rows` in all.
template <int D>
void CapacitanceMatrix::eliminate(std::int64_t j, double* y, std::int64_t rows) const noexcept {
  const double* L0 = column(j);
  const double* L1 = column(j + 1);
  y += j;
  const std::int64_t below = rows - j - D;
  y[0] /= L0[0];
  y[1] = (y[1] - L0[1] * y[0]) / L1[0];
  if constexpr (D == 2) {
    subtract_columns(L0 + 2, L1 + 1, y, y + 2, below);
  } else {
    const double* L2 = column(j + 2);
    y[2] = (y[2] - L0[2] * y[0] - L1[1] * y[1]) / L2[0];
    subtract_columns(L0 + 3, L1 + 2, L2 + 1, y, y + 3, below);
  }
}

template <int D>
CapacitanceStatus CapacitanceMatrix::add_node(std::span<const double> blocks) noexcept {
  const std::int64_t m = D * std::int64_t{nodes_};

  // New rows of L: [Y S] with L Y^T = C_old,new and S S^T = C_new,new - Y Y^T.
  double* Y[D];
  for (std::int64_t p = 0; p < D; ++p) {
    Y[p] = rows_.data() + p * capacity_;
    std::copy_n(blocks.data() + p * (m + D), m + D, Y[p]);
  }
  for (std::int64_t j = 0; j < m; j += D) {
    for (double* y : Y) eliminate<D>(j, y, m);
  }
  for (std::int64_t p = 0; p < D; ++p) {
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

  for (std::int64_t j = 0; j < m + D; ++j) {
    double* below = column(j) - j;
    for (std::int64_t p = std::max<std::int64_t>(0, j - m); p < D; ++p) below[m + p] = Y[p][j];
  }
  ++nodes_;
  return CapacitanceStatus::ok;
}

template <int D>
void CapacitanceMatrix::remove_node(Index k) noexcept {
  const std::int64_t m = D * std::int64_t{nodes_};
  const std::int64_t gone = D * std::int64_t{k};
  const std::int64_t rest = m - gone - D;

  // What the dropped columns carried of the later rows, W, must go into these rows' own factor: L' L'^T = L
  // L^T + W W^T.
  double* W[D];
  for (std::int64_t p = 0; p < D; ++p) {
    W[p] = rows_.data() + p * capacity_;
    std::copy_n(column(gone + p) + D - p, rest, W[p]);
  }
  for (std::int64_t j = 0; j < gone; ++j) {
    double* below = column(j) + gone - j;
    std::copy(below + D, below + D + rest, below);
  }
  for (std::int64_t j = 0; j < rest; ++j) {
    const double* from = column(gone + D + j);
    double* to = column(gone + j);
    std::copy(from, from + rest - j, to);
    for (double* w : W) rotate_in(to, w + j, rest - j);
  }
  --nodes_;
}

CapacitanceStatus CapacitanceMatrix::add(std::span<const double> blocks) noexcept {
  if (nodes_ == max_nodes_) return CapacitanceStatus::full;
  return dimension_ == 2 ? add_node<2>(blocks) : add_node<3>(blocks);
}

void CapacitanceMatrix::remove(Index k) noexcept {
  dimension_ == 2 ? remove_node<2>(k) : remove_node<3>(k);
}

void CapacitanceMatrix::solve(std::span<double> x) const noexcept {
  const std::int64_t m = std::int64_t{dimension_} * nodes_;
  for (std::int64_t j = 0; j < m; j += dimension_) {
    dimension_ == 2 ? eliminate<2>(j, x.data(), m) : eliminate<3>(j, x.data(), m);
  }
  for (std::int64_t j = m; j-- > 0;) {
    const double* L = column(j);
    double* y = x.data() + j;
    y[0] = (y[0] - dot(L + 1, y + 1, m - j - 1)) / L[0];
  }
}

}  // namespace palpate
