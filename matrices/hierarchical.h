// Symmetric matrices in nested low-rank form (H^2), on disk and in memory.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/vectors.h"

namespace palpate {

/// Largest rank; higher ones are refused, since a tick keeps that many numbers per level on its stack.
inline constexpr Index most_rank = 128;

/// Largest number of levels, for two million leaves; more are refused.
inline constexpr int most_levels = 21;

/// Binary tree of clusters over N stored nodes. Level l has 2^l clusters; its cluster i holds the nodes
/// [i N / 2^l, (i + 1) N / 2^l), so the numbers of levels and nodes determine the tree. Clusters are numbered
/// level by level: the root is 0, the children of c are 2 c + 1 and 2 c + 2.
struct ClusterTree {
  Index nodes = 0;
  int levels = 0;  ///< L: the leaves are on level L

  [[nodiscard]] Index clusters() const noexcept { return (Index{1} << (levels + 1)) - 1; }
  [[nodiscard]] Index leaves() const noexcept { return Index{1} << levels; }
  [[nodiscard]] Index first_of_level(int level) const noexcept { return (Index{1} << level) - 1; }
  [[nodiscard]] Index first_leaf() const noexcept { return first_of_level(levels); }
  [[nodiscard]] static int level(Index cluster) noexcept {
    return 31 - __builtin_clz(static_cast<unsigned>(cluster) + 1U);
  }
  [[nodiscard]] static Index parent(Index cluster) noexcept { return (cluster - 1) / 2; }
  /// First stored node of a cluster; the next cluster of the level begins at its end.
  [[nodiscard]] Index begin(Index cluster) const noexcept {
    const int at = level(cluster);
    return static_cast<Index>(std::int64_t{cluster - first_of_level(at)} * nodes >> at);
  }
  [[nodiscard]] Index end(Index cluster) const noexcept {
    const int at = level(cluster);
    return static_cast<Index>((std::int64_t{cluster - first_of_level(at)} + 1) * nodes >> at);
  }
  /// Leaf, as a cluster, that contains a stored node.
  [[nodiscard]] Index leaf_of(Index node) const noexcept {
    // The last i with i N / 2^L <= node, rounded down.
    const auto i = static_cast<Index>(((std::int64_t{node} + 1) * leaves() - 1) / nodes);
    return first_leaf() + i;
  }
};

/// Block of the Green's function matrix Xi = K^-1 [m/N] for the stored dofs, in which distant pairs of
/// clusters have low rank. For rows r of cluster a and columns c of cluster b, a far pair,
///
///    Xi(r, c) = V_a(r) S_ab V_b(c)^T,   V of a leaf is stored, V_parent = [V_child E_child, ...] is nested.
///
/// Near pairs of leaves are stored in full. Each pair of dofs is in exactly one near or far pair. Read-only;
/// the arrays are usually a mapping of the file. Copies share the data.
struct HierarchicalMatrix {
  using Pair = std::array<Index, 2>;

  int dimension = 3;  ///< d, dofs per node
  ClusterTree tree;
  std::vector<Index> rank;      ///< [clusters] columns of V; 0 if no far pair needs one
  std::vector<Pair> near_pair;  ///< leaves (row, column), row >= column; by columns
  std::vector<Pair> far_pair;   ///< clusters of one level, row > column; by columns

  std::shared_ptr<const float[]> basis;     ///< V of the leaves, one after the other, by rows [d m x rank]
  std::shared_ptr<const float[]> transfer;  ///< E of all clusters except the root [rank x rank of the parent]
  std::shared_ptr<const float[]> coupling;  ///< S of the far pairs [rank of row x rank of column] [m/N]
  std::shared_ptr<const float[]> near;      ///< entries of the near pairs by rows [m/N]

  /// [far pairs] Approximate error of each pair [-]: the Frobenius norm of L_row^-1 (exact - stored)
  /// L_column^-T, with L L^T = Xi of each leaf, one after the other. See ErrorBound.
  std::vector<double> pair_error;

  double scale = 1.0;  ///< factor on all stored entries

  double tolerance = 0.0;  ///< largest allowed force error of a touch, relative to the largest force [-]
  /// [rows x 6] Measured errors: nodes of a touch, touches, median, 99 % and worst force error, and the
  /// largest ratio of a total force's error to its ErrorBound.
  std::vector<double> certificate;

  // Derived from the above by `index`.
  std::vector<std::int64_t> basis_at;      ///< [leaves + 1] first entry of each leaf's V
  std::vector<std::int64_t> transfer_at;   ///< [clusters + 1]
  std::vector<std::int64_t> coupling_at;   ///< [far pairs + 1]
  std::vector<std::int64_t> near_at;       ///< [near pairs + 1]
  std::vector<std::int64_t> partner_from;  ///< [clusters + 1] first of each cluster's partners
  /// Far partners of each cluster, ascending: (other cluster, number of the pair).
  std::vector<Pair> partner;
  std::vector<std::int64_t> near_from;  ///< [leaves + 1] as partner_from, of near pairs
  std::vector<Pair> neighbour;          ///< as partner, of near pairs

  [[nodiscard]] std::int64_t order() const noexcept { return std::int64_t{dimension} * tree.nodes; }
  /// First near pair whose column is the leaf [0, leaves] or a later one: near pairs of one leaf are
  /// adjacent.
  [[nodiscard]] std::int64_t first_near_pair(Index leaf) const noexcept;
  /// Size of the four arrays [byte].
  [[nodiscard]] std::int64_t bytes() const noexcept;
  /// Fills the derived members, once tree, ranks and pairs are set.
  void index();
};

}  // namespace palpate
