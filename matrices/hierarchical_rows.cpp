#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <utility>

#include "matrices/hierarchical_product.h"
#include "matrices/hierarchical_walk.h"

namespace palpate {
namespace {
using namespace nested;

constexpr std::size_t columns_at_once = 1024;  // of a row, sorted by leaves

/// A block row, evaluated one leaf of columns at a time.
template <int D>
class BlockRow {
 public:
  BlockRow(const HierarchicalMatrix& matrix, Index row) noexcept
      : walk_{matrix},
        leaf_(matrix.tree.leaf_of(row)),
        row_in_leaf_(row - matrix.tree.begin(leaf_)),
        highest_(walk_.levels()) {
    for (int axis = 0; axis < D; ++axis)
      std::copy_n(walk_.basis(leaf_, D * row_in_leaf_ + axis), walk_.rank(leaf_),
                  up_[at(highest_)][at(axis)].begin());
  }

  /// Moves on to a leaf of columns; cheapest if it is near the one before.
  void go(Index leaf) noexcept {
    near_ = walk_.near_pair(leaf_, leaf);
    if (near_ < 0) reach(leaf);
  }

  /// Evaluates the block at a column of the leaf; entry (i, j) goes to block[i * stride + j].
  void block(Index leaf, Index column, double* block, std::ptrdiff_t stride) const noexcept {
    const HierarchicalMatrix& m = walk_.matrix;
    const std::int64_t in_leaf = std::int64_t{D} * (column - m.tree.begin(leaf)),
                       row_in_leaf = std::int64_t{D} * row_in_leaf_;
    if (near_ >= 0) {
      const float* entries = m.near.get() + m.near_at[at(near_)];
      const bool stored = leaf_ >= leaf;  // else its transpose
      const Index by_rows = stored ? leaf : leaf_;
      const std::int64_t width = std::int64_t{D} * (m.tree.end(by_rows) - m.tree.begin(by_rows));
      for (int i = 0; i < D; ++i) {
        for (int j = 0; j < D; ++j) {
          block[i * stride + j] =
              m.scale * static_cast<double>(stored ? entries[(row_in_leaf + i) * width + in_leaf + j]
                                                   : entries[(in_leaf + j) * width + row_in_leaf + i]);
        }
      }
      return;
    }
    const Index rank = walk_.rank(leaf);
    const auto entries =
        products(rows_from<D>(walk_.basis(leaf, in_leaf), rank), terms(down_[at(walk_.levels())]), rank);
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j) block[i * stride + j] = m.scale * entries[at(i)][at(j)];
  }

 private:
  /// Terms of the row for a cluster of columns, by which V of the columns is multiplied.
  struct Down {
    Index cluster = -1;
    std::array<Terms, D> terms;
  };

  [[nodiscard]] static std::array<const double*, D> terms(const Down& down) noexcept {
    std::array<const double*, D> of_axes;
    for (std::size_t axis = 0; axis < D; ++axis) of_axes[axis] = down.terms[axis].data();
    return of_axes;
  }

  /// Computes the terms of a far leaf, from the lowest cluster that is also above the leaf before.
  void reach(Index leaf) noexcept {
    int level = across_;
    if (level == 0 || down_[at(level)].cluster != walk_.above(leaf, level)) {
      level = 1;
      Index pair = -1;
      while (level <= walk_.levels()) {
        const Index a = walk_.above(leaf_, level), b = walk_.above(leaf, level);
        pair = a == b ? -1 : walk_.far_pair(a, b);
        if (pair >= 0) break;
        ++level;
      }
      climb(level);
      cross(pair, level, walk_.above(leaf, level));
      across_ = level;
    } else {
      while (level < walk_.levels() && down_[at(level + 1)].cluster == walk_.above(leaf, level + 1)) ++level;
    }
    for (++level; level <= walk_.levels(); ++level) descend(level, walk_.above(leaf, level));
  }

  /// Computes the row of V on all levels from the leaf's up to `level`.
  void climb(int level) noexcept {
    for (; highest_ > level; --highest_) {
      const Index c = walk_.above(leaf_, highest_), parent = ClusterTree::parent(c);
      for (int axis = 0; axis < D; ++axis) {
        Terms& to = up_[at(highest_ - 1)][at(axis)];
        std::fill_n(to.begin(), walk_.rank(parent), 0.0);
        add_transposed(walk_.transfer(c), walk_.rank(c), walk_.rank(parent),
                       up_[at(highest_)][at(axis)].data(), to.data());
      }
    }
  }

  void cross(Index pair, int level, Index b) noexcept {
    Down& to = down_[at(level)];
    to.cluster = b;
    for (int axis = 0; axis < D; ++axis) {
      std::fill_n(to.terms[at(axis)].begin(), walk_.rank(b), 0.0);
      walk_.couple(pair, b, walk_.above(leaf_, level), up_[at(level)][at(axis)].data(),
                   to.terms[at(axis)].data());
    }
    for (int below = level + 1; below <= walk_.levels(); ++below) down_[at(below)].cluster = -1;
  }

  void descend(int level, Index c) noexcept {
    const Index parent = ClusterTree::parent(c);
    Down& to = down_[at(level)];
    to.cluster = c;
    for_each_product<D>(walk_.transfer(c), walk_.rank(c), walk_.rank(parent), terms(down_[at(level - 1)]),
                        [&](Index term, const std::array<double, D>& sums) {
                          for (std::size_t axis = 0; axis < D; ++axis) to.terms[axis][at(term)] = sums[axis];
                        });
    if (level < walk_.levels()) down_[at(level + 1)].cluster = -1;
  }

  Walk walk_;
  Index leaf_, row_in_leaf_;
  int highest_;      // level that up_ reaches
  int across_ = 0;   // level of the far pair of the leaf of columns; 0 if there was none yet
  Index near_ = -1;  // number of the near pair, -1 if they are far
  std::array<std::array<Terms, D>, levels_at_most> up_;
  std::array<Down, levels_at_most> down_;
};

/// Columns grouped by leaf, leaves ascending.
class ColumnsOfLeaves {
 public:
  ColumnsOfLeaves(const ClusterTree& tree, std::span<const Index> columns) noexcept {
    heads_.fill(-1);
    for (std::size_t k = 0; k < columns.size(); ++k) {
      const Index leaf = tree.leaf_of(columns[k]);
      std::size_t place = at(leaf) % heads_.size();
      while (heads_[place] >= 0 && leaves_[at(heads_[place])].leaf != leaf)
        place = (place + 1) % heads_.size();
      if (heads_[place] < 0) {
        heads_[place] = static_cast<std::int16_t>(count_);
        leaves_[count_++] = {leaf, -1};
      }
      Columns& of = leaves_[at(heads_[place])];
      next_[k] = static_cast<std::int16_t>(of.first);
      of.first = static_cast<Index>(k);
    }
    std::sort(leaves_.begin(), leaves_.begin() + std::ptrdiff_t(count_),
              [](const Columns& a, const Columns& b) { return a.leaf < b.leaf; });
  }

  struct Columns {
    Index leaf;
    Index first;  ///< one of its columns
  };
  [[nodiscard]] std::span<const Columns> leaves() const noexcept { return {leaves_.data(), count_}; }
  /// Next column of the same leaf, -1 after the last.
  [[nodiscard]] Index next(Index column) const noexcept { return next_[at(column)]; }

 private:
  std::array<std::int16_t, 2 * columns_at_once> heads_;  // by leaf, with linear probing: place in leaves_
  std::array<Columns, columns_at_once> leaves_;
  std::array<std::int16_t, columns_at_once> next_;
  std::size_t count_ = 0;
};

template <int D>
void gather_dimension(const HierarchicalMatrix& matrix, Index row, std::span<const Index> columns,
                      double* blocks) noexcept {
  BlockRow<D> by(matrix, row);
  const auto stride = D * std::ssize(columns);
  for (std::size_t begin = 0; begin < columns.size(); begin += columns_at_once) {
    const auto some = columns.subspan(begin, std::min(columns_at_once, columns.size() - begin));
    const ColumnsOfLeaves sorted(matrix.tree, some);
    for (const auto& [leaf, first] : sorted.leaves()) {
      by.go(leaf);
      for (Index k = first; k >= 0; k = sorted.next(k))
        by.block(leaf, some[at(k)], blocks + D * (std::int64_t(begin) + k), stride);
    }
  }
}

}  // namespace

void gather_blocks(const HierarchicalMatrix& matrix, Index row, std::span<const Index> columns,
                   std::span<double> blocks) noexcept {
  if (matrix.dimension == 2) {
    gather_dimension<2>(matrix, row, columns, blocks.data());
  } else {
    gather_dimension<3>(matrix, row, columns, blocks.data());
  }
}

}  // namespace palpate
