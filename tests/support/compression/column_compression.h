// Compressed Green's functions from all columns of Xi, tile by tile: what sketching is compared with.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

#include "matrices/hierarchical.h"
#include "precompute/compression/cluster_pairs.h"
#include "precompute/compression/selected_solver.h"

namespace palpate::test {

/// Processor time of all threads in the parts of a compression from columns [s].
struct ColumnTimes {
  double solves = 0.0;   ///< of all columns of the lower triangle
  double leaves = 0.0;   ///< compression of the leaves' columns as they come
  double joining = 0.0;  ///< of siblings, and of rows and columns

  ColumnTimes& operator+=(const ColumnTimes& more) {
    solves += more.solves;
    leaves += more.leaves;
    joining += more.joining;
    return *this;
  }
};

/// Xi of the stored dofs as a HierarchicalMatrix, from all of its columns.
///
/// A tile is the columns of some leaves side by side, solved for at their own rows and those of later leaves.
/// Near pairs are copied. The far rows of a leaf's columns, weighed by the roots of the leaves on both sides,
/// give a Gram matrix, whose eigenvectors are the basis of its columns; of the far rows only their part in
/// this basis is kept. Once two siblings are there, the same joins them to their parent, and so on up the
/// tree: what is held is the tiles at work, a front of later rows per level, and the rows of the far pairs in
/// the bases of their columns. At last rows and columns get one basis per cluster, from the Gram matrix of
/// both.
class ColumnCompression {
 public:
  /// `stored_dofs` [d N] as for Compression, kept by reference; `tile_leaves` is a power of 2.
  ColumnCompression(const Factor& factor, std::span<const std::int64_t> stored_dofs, int dimension,
                    const ClusteredNodes& nodes, int jobs, Index tile_leaves = 4);

  /// The matrix; each basis leaves rows of L^-1 Xi L^-T, L the roots of the leaves, off by at most `cut` by
  /// loads of +-1 on all that is far, in the root mean square over its cluster. To be called once.
  HierarchicalMatrix compress(double cut);

  /// What `compress` would take, from so many of its tiles; without `joining`, which is little.
  ColumnTimes estimate(double cut, Index count);

  [[nodiscard]] const ColumnTimes& times() const noexcept { return times_; }
  /// Multiplications and additions of the solves.
  [[nodiscard]] double flops() const;
  /// Bytes of the rows of the far pairs in the bases of their columns.
  [[nodiscard]] std::int64_t kept_bytes() const noexcept { return kept_bytes_; }

 private:
  using Matrix = Eigen::MatrixXd;
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// A cluster that waits for its sibling: the rows of its parent's and its ancestors' far pairs in the basis
  /// of its columns, in the order of `later_pairs`.
  struct Front {
    bool there = false;
    std::vector<FloatRows> rows;
  };
  /// What a thread works with.
  struct Desk {
    SelectedSolver::Workspace workspace;
    std::vector<double> tile;  // [rows of the tile's leaf and later ones x columns of the tile]
    ColumnTimes times;
  };

  [[nodiscard]] std::int64_t first_dof(Index c) const;
  [[nodiscard]] std::int64_t dofs(Index c) const;
  [[nodiscard]] std::span<const HierarchicalMatrix::Pair> partners(Index c) const;
  [[nodiscard]] std::vector<HierarchicalMatrix::Pair> later_pairs(Index c) const;
  [[nodiscard]] Index tiles() const { return matrix_.tree.leaves() / tile_leaves_; }
  /// First cluster of a tile.
  [[nodiscard]] Index first_of(Index tile) const { return matrix_.tree.first_leaf() + tile * tile_leaves_; }
  [[nodiscard]] std::span<const std::int64_t> tile_rows(Index tile) const;
  [[nodiscard]] std::span<const std::int64_t> tile_columns(Index tile) const;
  [[nodiscard]] double flops_of(Index tile) const;
  void solve_tile(Index tile, Desk& desk);
  void keep_near(Index tile, const Desk& desk);
  Front compress_leaf(Index c, Index tile, Desk& desk, double cut);
  std::vector<Front> work_on(Index tile, Desk& desk, double cut);
  Front joined(Index parent, Front a, Front b, double cut);
  void hand_up(Index c, Front front, double cut);
  void keep_own_pairs(Index c, Front& front);
  void weigh_rows();
  void find_column_covariances();
  void join_level(int level, double cut);
  void find_basis(Index c, double cut);
  void shorten_rows(Index pair, int level);
  [[nodiscard]] Matrix part_in_rows(Index pair, Index c) const;
  [[nodiscard]] HierarchicalMatrix packed();

  SelectedSolver solver_;
  std::span<const std::int64_t> stored_dofs_;
  int jobs_;
  Index tile_leaves_;
  HierarchicalMatrix matrix_;
  std::shared_ptr<float[]> near_;
  std::vector<Rows> root_;     // [leaves] L
  std::vector<bool> needed_;   // [clusters] itself or one above it has a far pair
  std::vector<Front> fronts_;  // [clusters]
  std::mutex mutex_;           // of fronts_
  std::vector<Matrix>
      column_basis_;             // [clusters] of a leaf its basis, of others those of both children stacked
  std::vector<FloatRows> rows_;  // [far pairs] in the basis of the columns, then in both
  std::vector<Matrix> covariance_;   // [clusters] of later rows in the basis of the columns
  std::vector<Matrix> basis_;        // [clusters] as column_basis_, of rows and columns
  std::vector<double> compliance_;   // [clusters] mean of the diagonal of Xi [m/N]
  std::vector<Matrix> change_;       // [clusters] basis_^T column_basis_
  std::vector<std::int64_t> place_;  // [clusters] where its rows are among those of its level
  ColumnTimes times_;
  std::int64_t kept_bytes_ = 0;
};

}  // namespace palpate::test
