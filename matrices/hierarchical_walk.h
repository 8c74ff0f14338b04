// Sums over a matrix in nested low-rank form, for its rows and its products.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "matrices/hierarchical.h"

namespace palpate::nested {

using Pair = HierarchicalMatrix::Pair;
using Terms = std::array<double, std::size_t{most_rank}>;

inline constexpr std::size_t levels_at_most = most_levels + 1;

inline std::size_t at(std::int64_t i) noexcept {
  return static_cast<std::size_t>(i);
}

inline double dot(const float* a, const double* b, Index count) noexcept {
  double sum = 0.0;
#pragma omp simd reduction(+ : sum)
  for (Index k = 0; k < count; ++k) sum += static_cast<double>(a[k]) * b[k];
  return sum;
}

inline void add(const float* a, double factor, double* sum, Index count) noexcept {
#pragma omp simd
  for (Index k = 0; k < count; ++k) sum[k] += factor * static_cast<double>(a[k]);
}

/// Products of R rows A_p with `from`, computed side by side.
template <std::size_t R>
std::array<double, R> dots(const std::array<const float*, R>& A, const double* from, Index count) noexcept {
  std::array<double, R> sum{};
  if constexpr (R == 2) {
    double s0 = 0.0, s1 = 0.0;
    const float *a0 = A[0], *a1 = A[1];
#pragma omp simd reduction(+ : s0, s1)
    for (Index k = 0; k < count; ++k) {
      s0 += static_cast<double>(a0[k]) * from[k];
      s1 += static_cast<double>(a1[k]) * from[k];
    }
    sum = {s0, s1};
  } else {
    double s0 = 0.0, s1 = 0.0, s2 = 0.0;
    const float *a0 = A[0], *a1 = A[1], *a2 = A[2];
#pragma omp simd reduction(+ : s0, s1, s2)
    for (Index k = 0; k < count; ++k) {
      s0 += static_cast<double>(a0[k]) * from[k];
      s1 += static_cast<double>(a1[k]) * from[k];
      s2 += static_cast<double>(a2[k]) * from[k];
    }
    sum = {s0, s1, s2};
  }
  return sum;
}

/// to = A from, A [rows x columns] by rows.
inline void multiply(const float* A, Index rows, Index columns, const double* from, double* to) noexcept {
  for (Index i = 0; i < rows; ++i) to[i] = dot(A + std::int64_t{i} * columns, from, columns);
}

/// to += A^T from, A [rows x columns] by rows.
inline void add_transposed(const float* A, Index rows, Index columns, const double* from,
                           double* to) noexcept {
  for (Index i = 0; i < rows; ++i) add(A + std::int64_t{i} * columns, from[i], to, columns);
}

/// The matrix with the look-ups of a walk through its tree.
struct Walk {
  const HierarchicalMatrix& matrix;

  [[nodiscard]] int levels() const noexcept { return matrix.tree.levels; }
  [[nodiscard]] Index rank(Index c) const noexcept { return matrix.rank[at(c)]; }
  /// Cluster on a level that contains a leaf.
  [[nodiscard]] Index above(Index leaf, int level) const noexcept {
    return matrix.tree.first_of_level(level) + ((leaf - matrix.tree.first_leaf()) >> (levels() - level));
  }
  /// Row of V for a dof of a leaf.
  [[nodiscard]] const float* basis(Index leaf, std::int64_t dof_in_leaf) const noexcept {
    return matrix.basis.get() + matrix.basis_at[at(leaf - matrix.tree.first_leaf())] +
           dof_in_leaf * rank(leaf);
  }
  [[nodiscard]] const float* transfer(Index c) const noexcept {
    return matrix.transfer.get() + matrix.transfer_at[at(c)];
  }
  /// Far partners of a cluster.
  [[nodiscard]] std::span<const Pair> partners(Index c) const noexcept {
    return {matrix.partner.data() + matrix.partner_from[at(c)],
            matrix.partner.data() + matrix.partner_from[at(c) + 1]};
  }
  [[nodiscard]] std::span<const Pair> neighbours(Index leaf) const noexcept {
    const std::size_t i = at(leaf - matrix.tree.first_leaf());
    return {matrix.neighbour.data() + matrix.near_from[i], matrix.neighbour.data() + matrix.near_from[i + 1]};
  }
  /// Number of the far pair of two clusters of a level, -1 if they are none.
  [[nodiscard]] Index far_pair(Index a, Index b) const noexcept {
    return find(matrix.partner, matrix.partner_from[at(a)], matrix.partner_from[at(a) + 1], b);
  }
  [[nodiscard]] Index near_pair(Index a, Index b) const noexcept {
    const std::size_t leaf = at(a - matrix.tree.first_leaf());
    return find(matrix.neighbour, matrix.near_from[leaf], matrix.near_from[leaf + 1], b);
  }
  /// to += S_ab from, or S_ab^T from if `a` is the column of the pair.
  void couple(Index pair, Index a, Index b, const double* from, double* to) const noexcept {
    const float* S = matrix.coupling.get() + matrix.coupling_at[at(pair)];
    if (a > b) {
      for (Index i = 0; i < rank(a); ++i) to[i] += dot(S + std::int64_t{i} * rank(b), from, rank(b));
    } else {
      add_transposed(S, rank(b), rank(a), from, to);
    }
  }

 private:
  [[nodiscard]] static Index find(const std::vector<Pair>& partners, std::int64_t from, std::int64_t to,
                                  Index other) noexcept {
    const auto begin = partners.begin() + from, end = partners.begin() + to;
    const auto found =
        std::lower_bound(begin, end, other, [](const Pair& pair, Index b) { return pair[0] < b; });
    return found != end && (*found)[0] == other ? (*found)[1] : -1;
  }
};

}  // namespace palpate::nested
