#include "formats/hierarchical_product.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace palpate {
namespace {

using Pair = HierarchicalMatrix::Pair;
using Terms = std::array<double, std::size_t{most_rank}>;

constexpr std::size_t levels_at_most = most_levels + 1;
constexpr std::size_t leaves_at_once = 16;  // that carry force: what is kept of them is on the stack
constexpr std::size_t nodes_at_once = 256;  // of those leaves
constexpr std::size_t kept_columns = 8;     // leaves whose way through the tree a row remembers

std::size_t at(std::int64_t i) noexcept {
  return static_cast<std::size_t>(i);
}

double dot(const float* a, const double* b, Index count) noexcept {
  double sum = 0.0;
#pragma omp simd reduction(+ : sum)
  for (Index k = 0; k < count; ++k) sum += static_cast<double>(a[k]) * b[k];
  return sum;
}

void add(const float* a, double factor, double* sum, Index count) noexcept {
#pragma omp simd
  for (Index k = 0; k < count; ++k) sum[k] += factor * static_cast<double>(a[k]);
}

/// to = A from, A [rows x columns] by rows.
void multiply(const float* A, Index rows, Index columns, const double* from, double* to) noexcept {
  for (Index i = 0; i < rows; ++i) to[i] = dot(A + std::int64_t{i} * columns, from, columns);
}

/// to += A^T from, A [rows x columns] by rows.
void add_transposed(const float* A, Index rows, Index columns, const double* from, double* to) noexcept {
  for (Index i = 0; i < rows; ++i) add(A + std::int64_t{i} * columns, from[i], to, columns);
}

/// The matrix as seen while walking its tree.
struct Walk {
  const HierarchicalMatrix& matrix;

  [[nodiscard]] int levels() const noexcept { return matrix.tree.levels; }
  [[nodiscard]] Index rank(Index c) const noexcept { return matrix.rank[at(c)]; }
  /// Cluster of a level that a leaf is in.
  [[nodiscard]] Index above(Index leaf, int level) const noexcept {
    return matrix.tree.first_of_level(level) + ((leaf - matrix.tree.first_leaf()) >> (levels() - level));
  }
  /// V of a dof of a leaf.
  [[nodiscard]] const float* basis(Index leaf, std::int64_t dof_in_leaf) const noexcept {
    return matrix.basis.get() + matrix.basis_at[at(leaf - matrix.tree.first_leaf())] +
           dof_in_leaf * rank(leaf);
  }
  [[nodiscard]] const float* transfer(Index c) const noexcept {
    return matrix.transfer.get() + matrix.transfer_at[at(c)];
  }
  /// Number of the far pair of two clusters of a level, -1 where they are none.
  [[nodiscard]] Index far_pair(Index a, Index b) const noexcept {
    return find(matrix.partner, matrix.partner_from[at(a)], matrix.partner_from[at(a) + 1], b);
  }
  [[nodiscard]] Index near_pair(Index a, Index b) const noexcept {
    const std::size_t leaf = at(a - matrix.tree.first_leaf());
    return find(matrix.neighbour, matrix.near_from[leaf], matrix.near_from[leaf + 1], b);
  }
  /// to += S_ab from, or S_ab^T where `a` is the column of the pair.
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

/// A block row, column by column.
template <int D>
class BlockRow {
 public:
  BlockRow(const HierarchicalMatrix& matrix, Index row) noexcept
      : walk_{matrix}, leaf_(matrix.tree.leaf_of(row)), row_in_leaf_(row - matrix.tree.begin(leaf_)) {
    const Index k = walk_.rank(leaf_);
    for (int axis = 0; axis < D; ++axis) {
      const float* V = walk_.basis(leaf_, D * row_in_leaf_ + axis);
      std::copy_n(V, k, up_[at(walk_.levels())][at(axis)].begin());
    }
    highest_ = walk_.levels();
  }

  /// The block at `column`; entry (i, j) goes to block[i * stride + j].
  void block(Index column, double* block, std::ptrdiff_t stride) noexcept {
    const ClusterTree& tree = walk_.matrix.tree;
    const Index leaf = tree.leaf_of(column);
    const Column& by = find(leaf);
    const std::int64_t in_leaf = column - tree.begin(leaf);
    for (int i = 0; i < D; ++i) {
      for (int j = 0; j < D; ++j) {
        block[i * stride + j] =
            walk_.matrix.scale * (by.near >= 0 ? near_entry(by, leaf, D * row_in_leaf_ + i, D * in_leaf + j)
                                               : dot(walk_.basis(leaf, D * in_leaf + j),
                                                     by.terms[at(i)].data(), walk_.rank(leaf)));
      }
    }
  }

 private:
  /// What the row and a leaf of columns have in common.
  struct Column {
    Index leaf = -1;
    Index near = -1;             // number of the near pair, -1 where they are far
    std::array<Terms, D> terms;  // far: what the V of a column is multiplied by
  };

  [[nodiscard]] double near_entry(const Column& by, Index leaf, std::int64_t i,
                                  std::int64_t j) const noexcept {
    const HierarchicalMatrix& m = walk_.matrix;
    const float* entries = m.near.get() + m.near_at[at(by.near)];
    const auto width = [&](Index c) { return std::int64_t{D} * (m.tree.end(c) - m.tree.begin(c)); };
    return static_cast<double>(leaf_ >= leaf ? entries[i * width(leaf) + j] : entries[j * width(leaf_) + i]);
  }

  const Column& find(Index leaf) noexcept {
    for (std::size_t k = 0; k < std::min(found_, kept_columns); ++k)
      if (columns_[k].leaf == leaf) return columns_[k];
    Column& column = columns_[found_++ % kept_columns];
    column.leaf = leaf;
    column.near = -1;
    for (int level = 1; level <= walk_.levels(); ++level) {
      const Index a = walk_.above(leaf_, level), b = walk_.above(leaf, level);
      if (a == b) continue;
      const Index pair = walk_.far_pair(a, b);
      if (pair < 0) continue;
      reach(level);
      for (int axis = 0; axis < D; ++axis) descend(pair, level, leaf, axis, column.terms[at(axis)]);
      return column;
    }
    column.near = walk_.near_pair(leaf_, leaf);
    return column;
  }

  /// The row of V on all levels down from `level`.
  void reach(int level) noexcept {
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

  /// Across a far pair and down to a leaf.
  void descend(Index pair, int level, Index leaf, int axis, Terms& terms) noexcept {
    const Index a = walk_.above(leaf_, level);
    Index b = walk_.above(leaf, level);
    std::fill_n(terms.begin(), walk_.rank(b), 0.0);
    walk_.couple(pair, b, a, up_[at(level)][at(axis)].data(), terms.data());
    for (int below = level + 1; below <= walk_.levels(); ++below) {
      const Terms parent = terms;
      const Index child = walk_.above(leaf, below);
      multiply(walk_.transfer(child), walk_.rank(child), walk_.rank(b), parent.data(), terms.data());
      b = child;
    }
  }

  Walk walk_;
  Index leaf_, row_in_leaf_;
  int highest_;
  std::size_t found_ = 0;
  std::array<std::array<Terms, D>, levels_at_most> up_;
  std::array<Column, kept_columns> columns_;
};

/// Forces on the nodes of a few leaves, and what they do to other nodes.
template <int D>
class FieldOfLeaves {
 public:
  FieldOfLeaves(const HierarchicalMatrix& matrix, Index first_node, std::span<double> u) noexcept
      : walk_{matrix}, first_(first_node), end_(first_node + static_cast<Index>(u.size() / D)), u_(u) {}

  /// False when there is no more room.
  bool take(Index node, const double* f) noexcept {
    const Index leaf = walk_.matrix.tree.leaf_of(node);
    const auto begin = active_[at(walk_.levels())].begin();
    auto place = std::find(begin, begin + std::ptrdiff_t(leaves_), leaf);
    if (nodes_ == nodes_at_once || (place == begin + std::ptrdiff_t(leaves_) && leaves_ == leaves_at_once))
      return false;
    const auto slot = static_cast<std::size_t>(place - begin);
    if (slot == leaves_) {
      *place = leaf;
      ++leaves_;
    }
    sources_[nodes_++] = {node, slot, f};
    return true;
  }

  void spread() noexcept {
    if (nodes_ == 0) return;
    climb();
    descend(0, 0, false);
    nodes_ = leaves_ = 0;
  }

 private:
  struct Source {
    Index node;
    std::size_t leaf;  ///< its place among the active ones
    const double* f;
  };

  /// The far field of each active cluster: terms of V^T f.
  void climb() noexcept {
    const int L = walk_.levels();
    count_[at(L)] = leaves_;
    for (std::size_t slot = 0; slot < leaves_; ++slot)
      std::fill_n(strength_[at(L)][slot].begin(), walk_.rank(active_[at(L)][slot]), 0.0);
    for (std::size_t k = 0; k < nodes_; ++k) {
      const Source& s = sources_[k];
      const Index leaf = active_[at(L)][s.leaf];
      const std::int64_t first = std::int64_t{D} * (s.node - walk_.matrix.tree.begin(leaf));
      for (int axis = 0; axis < D; ++axis)
        add(walk_.basis(leaf, first + axis), walk_.matrix.scale * s.f[axis], strength_[at(L)][s.leaf].data(),
            walk_.rank(leaf));
    }
    for (int level = L; level > 0; --level) {
      std::size_t& count = count_[at(level - 1)];
      count = 0;
      for (std::size_t slot = 0; slot < count_[at(level)]; ++slot) {
        const Index c = active_[at(level)][slot], parent = ClusterTree::parent(c);
        const auto begin = active_[at(level - 1)].begin();
        const auto place =
            static_cast<std::size_t>(std::find(begin, begin + std::ptrdiff_t(count), parent) - begin);
        Terms& to = strength_[at(level - 1)][place];
        if (place == count) {
          active_[at(level - 1)][count++] = parent;
          std::fill_n(to.begin(), walk_.rank(parent), 0.0);
        }
        add_transposed(walk_.transfer(c), walk_.rank(c), walk_.rank(parent),
                       strength_[at(level)][slot].data(), to.data());
      }
    }
  }

  /// `moved`: whether the parent's terms are not zero.
  void descend(Index c, int level, bool moved) noexcept {
    const ClusterTree& tree = walk_.matrix.tree;
    if (tree.begin(c) >= end_ || tree.end(c) <= first_) return;
    Terms& terms = motion_[at(level)];
    if (moved) {
      multiply(walk_.transfer(c), walk_.rank(c), walk_.rank(ClusterTree::parent(c)),
               motion_[at(level - 1)].data(), terms.data());
    } else {
      std::fill_n(terms.begin(), walk_.rank(c), 0.0);
    }
    for (std::size_t slot = 0; slot < count_[at(level)]; ++slot) {
      const Index other = active_[at(level)][slot];
      const Index pair = other == c ? -1 : walk_.far_pair(c, other);
      if (pair < 0) continue;
      walk_.couple(pair, c, other, strength_[at(level)][slot].data(), terms.data());
      moved = true;
    }
    if (level < walk_.levels()) {
      descend(2 * c + 1, level + 1, moved);
      descend(2 * c + 2, level + 1, moved);
      return;
    }
    if (moved) move(c, terms);
    for (std::size_t slot = 0; slot < leaves_; ++slot) {
      const Index pair = walk_.near_pair(c, active_[at(level)][slot]);
      if (pair >= 0) push(c, slot, pair);
    }
  }

  /// The nodes of a leaf that are asked for: [first, second).
  [[nodiscard]] std::pair<Index, Index> asked(Index leaf) const noexcept {
    const ClusterTree& tree = walk_.matrix.tree;
    return {std::max(tree.begin(leaf), first_), std::min(tree.end(leaf), end_)};
  }

  void move(Index leaf, const Terms& terms) noexcept {
    const auto [from, to] = asked(leaf);
    const std::int64_t begin = std::int64_t{D} * walk_.matrix.tree.begin(leaf);
    for (std::int64_t dof = std::int64_t{D} * from; dof < std::int64_t{D} * to; ++dof)
      u_[at(dof - std::int64_t{D} * first_)] +=
          dot(walk_.basis(leaf, dof - begin), terms.data(), walk_.rank(leaf));
  }

  /// By the forces on a near leaf.
  void push(Index leaf, std::size_t slot, Index pair) noexcept {
    const HierarchicalMatrix& m = walk_.matrix;
    const Index other = active_[at(walk_.levels())][slot];
    const auto [from, to] = asked(leaf);
    const std::int64_t begin = std::int64_t{D} * m.tree.begin(leaf), first = std::int64_t{D} * from - begin,
                       count = std::int64_t{D} * (to - from), before = std::int64_t{D} * m.tree.begin(other),
                       width = std::int64_t{D} * (m.tree.end(other) - m.tree.begin(other)),
                       own_width = std::int64_t{D} * (m.tree.end(leaf) - m.tree.begin(leaf));
    const float* entries = m.near.get() + m.near_at[at(pair)];
    double* u = u_.data() + std::int64_t{D} * (from - first_);
    for (std::size_t k = 0; k < nodes_; ++k) {
      const Source& s = sources_[k];
      if (s.leaf != slot) continue;
      const std::int64_t column = std::int64_t{D} * s.node - before;
      for (int axis = 0; axis < D; ++axis) {
        const double force = m.scale * s.f[axis];
        if (leaf >= other) {
          for (std::int64_t i = 0; i < count; ++i)
            u[i] += force * static_cast<double>(entries[(first + i) * width + column + axis]);
        } else {
          add(entries + (column + axis) * own_width + first, force, u, static_cast<Index>(count));
        }
      }
    }
  }

  Walk walk_;
  Index first_, end_;
  std::span<double> u_;
  std::size_t nodes_ = 0, leaves_ = 0;
  std::array<Source, nodes_at_once> sources_;
  std::array<std::size_t, levels_at_most> count_;  // active clusters of a level
  std::array<std::array<Index, leaves_at_once>, levels_at_most> active_;
  std::array<std::array<Terms, leaves_at_once>, levels_at_most> strength_;
  std::array<Terms, levels_at_most> motion_;
};

template <int D>
void gather_dimension(const HierarchicalMatrix& matrix, Index row, std::span<const Index> columns,
                      double* blocks) noexcept {
  BlockRow<D> by(matrix, row);
  const auto stride = D * std::ssize(columns);
  for (std::size_t k = 0; k < columns.size(); ++k) by.block(columns[k], blocks + D * k, stride);
}

template <int D>
void displace_dimension(const HierarchicalMatrix& matrix, std::span<const Index> nodes, const double* f,
                        Index first_node, std::span<double> u) noexcept {
  FieldOfLeaves<D> field(matrix, first_node, u);
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    if (field.take(nodes[k], f + D * k)) continue;
    field.spread();
    field.take(nodes[k], f + D * k);
  }
  field.spread();
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

void displace(const HierarchicalMatrix& matrix, std::span<const Index> nodes, std::span<const double> f,
              Index first_node, std::span<double> u) noexcept {
  std::fill(u.begin(), u.end(), 0.0);
  if (matrix.dimension == 2) {
    displace_dimension<2>(matrix, nodes, f.data(), first_node, u);
  } else {
    displace_dimension<3>(matrix, nodes, f.data(), first_node, u);
  }
}

}  // namespace palpate
