// Symmetric matrices in nested low-rank form (H^2), on disk and in memory.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Ranks above it are refused: a tick keeps as many numbers a level on its stack.
inline constexpr Index most_rank = 128;

/// More levels are refused: two million leaves.
inline constexpr int most_levels = 21;

/// The binary tree of clusters over N stored nodes. Level l has 2^l clusters; cluster i of it are the nodes
/// [i N / 2^l, (i + 1) N / 2^l), so the number of levels and of nodes tell everything. Clusters are numbered
/// level after level: the root is 0, the children of c are 2 c + 1 and 2 c + 2.
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
  /// Where the stored nodes of a cluster begin; those of the next one of its level begin where they end.
  [[nodiscard]] Index begin(Index cluster) const noexcept {
    const int at = level(cluster);
    return static_cast<Index>(std::int64_t{cluster - first_of_level(at)} * nodes >> at);
  }
  [[nodiscard]] Index end(Index cluster) const noexcept {
    const int at = level(cluster);
    return static_cast<Index>((std::int64_t{cluster - first_of_level(at)} + 1) * nodes >> at);
  }
  /// Leaf, as a cluster, that a stored node is in.
  [[nodiscard]] Index leaf_of(Index node) const noexcept {
    // The last i with i N / 2^L <= node, rounded down.
    const auto i = static_cast<Index>(((std::int64_t{node} + 1) * leaves() - 1) / nodes);
    return first_leaf() + i;
  }
};

/// The block of the Green's function matrix Xi = K^-1 [m/N] for the stored dofs where pairs of clusters that
/// are far apart have low rank: with rows r of cluster a and columns c of cluster b, a far pair,
///
///   Xi(r, c) = V_a(r) S_ab V_b(c)^T,   V of a leaf is stored, V_parent = [V_child E_child, ...] is nested,
///
/// and pairs of leaves that are near are stored as they are. Each pair of dofs is in one near pair, or in one
/// far pair. Read-only; the arrays are usually a mapping of the file. Copies share the data.
struct HierarchicalMatrix {
  using Pair = std::array<Index, 2>;

  int dimension = 3;  ///< d, dofs a node
  ClusterTree tree;
  std::vector<Index> rank;      ///< [clusters] columns of V; 0 where no far pair needs one
  std::vector<Pair> near_pair;  ///< leaves (row, column), row >= column; by columns
  std::vector<Pair> far_pair;   ///< clusters of one level, row > column; by columns

  std::shared_ptr<const float[]> basis;     ///< V of the leaves, one after the other, by rows [d m x rank]
  std::shared_ptr<const float[]> transfer;  ///< E of the clusters but the root [rank x rank of the parent]
  std::shared_ptr<const float[]> coupling;  ///< S of the far pairs [rank of row x rank of column] [m/N]
  std::shared_ptr<const float[]> near;      ///< entries of the near pairs by rows [m/N]

  /// [far pairs] By how much each pair is off [-], about: Frobenius' norm of L_row^-1 (what it is to be -
  /// what is stored) L_column^-T, with L L^T = Xi of each leaf, one after the other. See ErrorBound.
  std::vector<double> pair_error;

  double scale = 1.0;  ///< the matrix is this times what is stored

  double tolerance = 0.0;  ///< most that forces of touches may be off, relative to the largest [-]
  /// [rows x 6] What was measured: nodes of a touch, touches, their median, 99 % and worst force error, and
  /// the largest share that a total force's error has of its ErrorBound.
  std::vector<double> certificate;

  // What follows from the above: see `index`.
  std::vector<std::int64_t> basis_at;      ///< [leaves + 1] first entry of each leaf's V
  std::vector<std::int64_t> transfer_at;   ///< [clusters + 1]
  std::vector<std::int64_t> coupling_at;   ///< [far pairs + 1]
  std::vector<std::int64_t> near_at;       ///< [near pairs + 1]
  std::vector<std::int64_t> partner_from;  ///< [clusters + 1] first of each cluster's partners
  /// The other clusters of the far pairs of each cluster, ascending: (cluster, number of the pair).
  std::vector<Pair> partner;
  std::vector<std::int64_t> near_from;  ///< [leaves + 1] as partner_from, of near pairs
  std::vector<Pair> neighbour;          ///< as partner, of near pairs

  [[nodiscard]] std::int64_t order() const noexcept { return std::int64_t{dimension} * tree.nodes; }
  /// First near pair whose column is the leaf [0, leaves] or a later one: those of a leaf are side by side.
  [[nodiscard]] std::int64_t first_near_pair(Index leaf) const noexcept;
  /// Bytes of the four arrays.
  [[nodiscard]] std::int64_t bytes() const noexcept;
  /// Numbers the entries and lists the partners; once tree, ranks and pairs are there.
  void index();
};

}  // namespace palpate
