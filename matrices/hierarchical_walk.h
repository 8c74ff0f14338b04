// Sums over a matrix in nested low-rank form, for its rows and its products.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
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

inline constexpr Index lanes = 8;
using Lanes = double __attribute__((vector_size(lanes * sizeof(double))));
using FloatLanes = float __attribute__((vector_size(lanes * sizeof(float))));

/// Products of R rows A_r with C vectors, [C][R], side by side: each number is read once. The order of the
/// sums depends on the count alone, not on the processor. (`omp simd` would leave long chains of additions.)
template <std::size_t R, std::size_t C>
std::array<std::array<double, R>, C> products(const std::array<const float*, R>& A,
                                              const std::array<const double*, C>& from,
                                              Index count) noexcept {
  Lanes sums[C][R] = {};  // NOLINT(*-avoid-c-arrays): stay in registers
  const auto add_lanes = [&](Index k, const Lanes& share) {
    Lanes a[R];  // NOLINT(*-avoid-c-arrays)
    for (std::size_t r = 0; r < R; ++r) {
      FloatLanes of_row;
      std::memcpy(&of_row, A[r] + k, sizeof of_row);
      a[r] = __builtin_convertvector(of_row, Lanes);
    }
    for (std::size_t c = 0; c < C; ++c) {
      Lanes b;
      std::memcpy(&b, from[c] + k, sizeof b);
      b *= share;
      for (std::size_t r = 0; r < R; ++r) sums[c][r] += a[r] * b;
    }
  };
  Index k = 0;
  for (; k + lanes <= count; k += lanes) add_lanes(k, Lanes{1, 1, 1, 1, 1, 1, 1, 1});
  if (k < count && count >= lanes) {  // the last ones once more, without those that were added
    static constexpr std::array<double, std::size_t{2}* lanes> shares = {0, 0, 0, 0, 0, 0, 0, 0,
                                                                         1, 1, 1, 1, 1, 1, 1, 1};
    Lanes share;
    std::memcpy(&share, shares.data() + (count - k), sizeof share);
    add_lanes(count - lanes, share);
    k = count;
  }
  std::array<std::array<double, R>, C> all;
  for (std::size_t c = 0; c < C; ++c) {
    for (std::size_t r = 0; r < R; ++r) {
      const Lanes& s = sums[c][r];
      all[c][r] = ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
      for (Index rest = k; rest < count; ++rest) all[c][r] += static_cast<double>(A[r][rest]) * from[c][rest];
    }
  }
  return all;
}

inline void add(const float* a, double factor, double* sum, Index count) noexcept {
#pragma omp simd
  for (Index k = 0; k < count; ++k) sum[k] += factor * static_cast<double>(a[k]);
}

/// R rows, one after the other.
template <std::size_t R>
std::array<const float*, R> rows_from(const float* first, Index columns) noexcept {
  std::array<const float*, R> all;
  for (std::size_t r = 0; r < R; ++r) all[r] = first + static_cast<std::ptrdiff_t>(r) * columns;
  return all;
}

/// Calls visit(row, its products with C vectors) for A [rows x columns] by rows.
template <std::size_t C, class Visit>
void for_each_product(const float* A, Index rows, Index columns, const std::array<const double*, C>& from,
                      const Visit& visit) noexcept {
  constexpr Index side_by_side = C == 1 ? 4 : 3;  // as many sums as there are registers for
  const auto visit_some = [&]<std::size_t R>(std::integral_constant<std::size_t, R>, Index i) {
    const auto sums = products(rows_from<R>(A + std::int64_t{i} * columns, columns), from, columns);
    for (std::size_t r = 0; r < R; ++r) {
      std::array<double, C> of_row;
      for (std::size_t c = 0; c < C; ++c) of_row[c] = sums[c][r];
      visit(i + static_cast<Index>(r), of_row);
    }
  };
  Index i = 0;
  for (; i + side_by_side <= rows; i += side_by_side)
    visit_some(std::integral_constant<std::size_t, side_by_side>{}, i);
  for (; i < rows; ++i) visit_some(std::integral_constant<std::size_t, 1>{}, i);
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
      for_each_product<1>(S, rank(a), rank(b), {from},
                          [&](Index i, const std::array<double, 1>& sum) { to[i] += sum[0]; });
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
