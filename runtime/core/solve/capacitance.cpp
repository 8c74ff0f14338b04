#include "runtime/core/solve/capacitance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <type_traits>

#include "base/error.h"
#include "matrices/packed.h"
#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

/// Calls f with the dofs per node as a compile-time constant.
template <class F>
auto with_dimension(int dimension, const F& f) noexcept {
  switch (dimension) {
    case 1:
      return f(std::integral_constant<int, 1>());
    case 2:
      return f(std::integral_constant<int, 2>());
    default:
      return f(std::integral_constant<int, 3>());
  }
}

/// y -= L x for the part of L below a diagonal block: the D columns of a node, one right-hand side.
template <int D>
void subtract_columns(const std::array<const double*, D>& L, const std::array<double, D>& x,
                      double* __restrict y, std::int64_t count) noexcept {
#pragma omp simd
  for (std::int64_t i = 0; i < count; ++i) {
    double sum = 0.0;
    for (std::size_t p = 0; p < D; ++p) sum += L[p][i] * x[p];
    y[i] -= sum;
  }
}

constexpr std::int64_t panel = 4;  // columns eliminated from the later ones together

/// y -= L x and z -= L w for the part of L below two diagonal entries: L is read once.
void subtract_columns(const std::array<const double*, panel>& L, const std::array<double, panel>& x,
                      const std::array<double, panel>& w, double* __restrict y, double* __restrict z,
                      std::int64_t count) noexcept {
#pragma omp simd
  for (std::int64_t i = 0; i < count; ++i) {
    double sum = 0.0, other = 0.0;
    for (std::size_t p = 0; p < panel; ++p) {
      sum += L[p][i] * x[p];
      other += L[p][i] * w[p];
    }
    y[i] -= sum;
    z[i] -= other;
  }
}

/// Givens rotation of the column pair (L, w) that preserves L L^T + w w^T and zeroes the first entry of w.
void rotate_in(double* __restrict L, double* __restrict w, std::int64_t count) noexcept {
  const double r = std::sqrt(L[0] * L[0] + w[0] * w[0]);
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
  if (dimension < 1 || dimension > 3) {
    throw Error("nodes of " + std::to_string(dimension) + " dofs were asked for", "CapacitanceMatrix",
                "ask for 1, 2 or 3 dofs a node");
  }
  if (max_nodes < 1) {
    throw Error("room for " + std::to_string(max_nodes) + " held nodes was asked for", "CapacitanceMatrix",
                "ask for room for at least one");
  }
  L_.resize(packed_size(capacity_));
  rows_.resize(dimension_ * capacity_);
}

double* CapacitanceMatrix::column(std::int64_t j) noexcept {
  return L_.data() + packed_column(j, capacity_);
}
const double* CapacitanceMatrix::column(std::int64_t j) const noexcept {
  return L_.data() + packed_column(j, capacity_);
}

/// One node of the forward substitution L y = b: solves for the D entries of y from j on and eliminates them
/// from the later ones, of `rows` in all.
template <int D>
void CapacitanceMatrix::eliminate(std::int64_t j, double* y, std::int64_t rows) const noexcept {
  y += j;
  std::array<const double*, D> L;  // column j + p from row j on
  for (std::int64_t p = 0; p < D; ++p) L[p] = column(j + p) - p;
  std::array<double, D> x;
  for (std::size_t p = 0; p < D; ++p) {
    x[p] = y[p];
    for (std::size_t q = 0; q < p; ++q) x[p] -= L[q][p] * x[q];
    x[p] /= L[p][p];
    y[p] = x[p];
  }
  for (const double*& below : L) below += D;
  subtract_columns<D>(L, x, y + D, rows - j - D);
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

  // The contribution W of the dropped columns to the later rows must be added to the factor of these rows: L'
  // L'^T = L L^T + W W^T.
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
  return with_dimension(dimension_, [&](auto d) { return add_node<d>(blocks); });
}

/// Cholesky factorisation of columns [first, end), from which the previous ones are eliminated already; false
/// if a pivot is within rounding of zero relative to the diagonal of C, which is in rows_.
bool CapacitanceMatrix::factor_panel(std::int64_t first, std::int64_t end, std::int64_t rows) noexcept {
  for (std::int64_t j = first; j < end; ++j) {
    double* to = column(j);
    for (std::int64_t k = first; k < j; ++k) {
      const double* from = column(k) + (j - k);
      subtract(from, from[0], to, rows - j);
    }
    if (!(to[0] > pivot_tolerance * rows_[j] && std::isfinite(to[0]))) return false;
    const double scale = 1.0 / std::sqrt(to[0]);
    for (std::int64_t i = 0; i < rows - j; ++i) to[i] *= scale;
  }
  return true;
}

/// Eliminates the panel that starts at column `first` from all later columns, two at a time.
void CapacitanceMatrix::subtract_panel(std::int64_t first, std::int64_t rows) noexcept {
  std::array<const double*, panel> L;
  std::array<double, panel> x, w;
  for (std::int64_t j = first + panel; j < rows; j += 2) {
    for (std::size_t p = 0; p < panel; ++p) {
      L[p] = column(first + static_cast<std::int64_t>(p)) - (first + static_cast<std::int64_t>(p)) + j;
      x[p] = L[p][0];
    }
    double* y = column(j);
    if (j + 1 == rows) {
      subtract_columns<panel>(L, x, y, 1);
      return;
    }
    for (std::size_t p = 0; p < panel; ++p) {
      y[0] -= L[p][0] * x[p];
      w[p] = (++L[p])[0];
    }
    subtract_columns(L, x, w, y + 1, column(j + 1), rows - j - 1);
  }
}

CapacitanceStatus CapacitanceMatrix::assign(Index nodes, std::span<const double> lower) noexcept {
  clear();
  if (nodes > max_nodes_) return CapacitanceStatus::full;
  const std::int64_t m = std::int64_t{dimension_} * nodes;
  for (std::int64_t j = 0; j < m; ++j) {
    const double* from = lower.data() + packed_column(j, m);
    std::copy(from, from + (m - j), column(j));
    rows_[j] = from[0];
  }
  for (std::int64_t first = 0; first < m; first += panel) {
    const std::int64_t end = std::min(first + panel, m);
    if (!factor_panel(first, end, m)) return CapacitanceStatus::not_positive_definite;
    if (end - first == panel) subtract_panel(first, m);
  }
  nodes_ = nodes;
  return CapacitanceStatus::ok;
}

void CapacitanceMatrix::remove(Index k) noexcept {
  with_dimension(dimension_, [&](auto d) { remove_node<d>(k); });
}

void CapacitanceMatrix::solve(std::span<double> x) const noexcept {
  const std::int64_t m = std::int64_t{dimension_} * nodes_;
  with_dimension(dimension_, [&](auto d) {
    for (std::int64_t j = 0; j < m; j += d) eliminate<d>(j, x.data(), m);
  });
  for (std::int64_t j = m; j-- > 0;) {
    const double* L = column(j);
    double* y = x.data() + j;
    y[0] = (y[0] - dot(L + 1, y + 1, m - j - 1)) / L[0];
  }
}

/// Works on the scalar columns of L: the chain of divisions is as long for S right-hand sides as for one.
template <int S>
void CapacitanceMatrix::solve_systems(double* x) const noexcept {
  const std::int64_t m = std::int64_t{dimension_} * nodes_;
  std::array<double, S> y;
  for (std::int64_t j = 0; j < m; ++j) {
    const double* __restrict L = column(j) - j;
    for (std::int64_t s = 0; s < S; ++s) y[s] = x[s * m + j] /= L[j];
#pragma omp simd
    for (std::int64_t i = j + 1; i < m; ++i) {
      for (std::int64_t s = 0; s < S; ++s) x[s * m + i] -= L[i] * y[s];
    }
  }
  for (std::int64_t j = m; j-- > 0;) {
    const double* __restrict L = column(j) - j;
    for (std::int64_t s = 0; s < S; ++s) {
      double* system = x + s * m;
      system[j] = (system[j] - dot(L + j + 1, system + j + 1, m - j - 1)) / L[j];
    }
  }
}

void CapacitanceMatrix::solve(std::span<double> x, int systems) const noexcept {
  switch (systems) {
    case 1:
      return solve(x);
    case 2:
      return solve_systems<2>(x.data());
    default:
      return solve_systems<3>(x.data());
  }
}

}  // namespace palpate
