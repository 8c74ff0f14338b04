#include "matrices/hierarchical_product.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <utility>

namespace palpate {
namespace {

using Pair = HierarchicalMatrix::Pair;
using Terms = std::array<double, std::size_t{most_rank}>;

constexpr std::size_t levels_at_most = most_levels + 1;
constexpr std::size_t columns_at_once = 256;  // of a row, sorted by leaves
constexpr std::size_t leaves_at_once = 64;    // leaves that carry force
constexpr std::size_t nodes_at_once = 256;    // of those leaves
constexpr std::size_t terms_at_once = 16384;  // of those leaves and all above them: on the stack

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
void multiply(const float* A, Index rows, Index columns, const double* from, double* to) noexcept {
  for (Index i = 0; i < rows; ++i) to[i] = dot(A + std::int64_t{i} * columns, from, columns);
}

/// to += A^T from, A [rows x columns] by rows.
void add_transposed(const float* A, Index rows, Index columns, const double* from, double* to) noexcept {
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
                       row_in_leaf = D * row_in_leaf_;
    if (near_ >= 0) {
      const float* entries = m.near.get() + m.near_at[at(near_)];
      const bool stored = leaf_ >= leaf;  // else its transpose
      const Index by_rows = stored ? leaf : leaf_;
      const std::int64_t width = std::int64_t{D} * (m.tree.end(by_rows) - m.tree.begin(by_rows));
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j)
          block[i * stride + j] =
              m.scale * static_cast<double>(stored ? entries[(row_in_leaf + i) * width + in_leaf + j]
                                                   : entries[(in_leaf + j) * width + row_in_leaf + i]);
      return;
    }
    const Index rank = walk_.rank(leaf);
    const std::array<const float*, D> V = rows(walk_.basis(leaf, in_leaf), rank);
    for (int i = 0; i < D; ++i) {
      const std::array<double, D> entries = dots<D>(V, down_[at(walk_.levels())].terms[at(i)].data(), rank);
      for (int j = 0; j < D; ++j) block[i * stride + j] = m.scale * entries[at(j)];
    }
  }

 private:
  /// Terms of the row for a cluster of columns, by which V of the columns is multiplied.
  struct Down {
    Index cluster = -1;
    std::array<Terms, D> terms;
  };

  [[nodiscard]] static std::array<const float*, D> rows(const float* first, Index stride) noexcept {
    std::array<const float*, D> all;
    for (int k = 0; k < D; ++k) all[at(k)] = first + std::int64_t{k} * stride;
    return all;
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
    for (int axis = 0; axis < D; ++axis)
      multiply(walk_.transfer(c), walk_.rank(c), walk_.rank(parent),
               down_[at(level - 1)].terms[at(axis)].data(), to.terms[at(axis)].data());
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

/// Forces on the nodes of some leaves, and the displacements they cause.
template <int D>
class FieldOfLeaves {
 public:
  FieldOfLeaves(const HierarchicalMatrix& matrix, std::span<const NodeRange> ranges,
                std::span<double> u) noexcept
      : walk_{matrix}, ranges_(ranges), u_(u) {}

  /// Adds the force on a node; false if the capacity is exhausted.
  bool take(Index node, const double* f) noexcept {
    if (nodes_ == nodes_at_once) return false;
    const Index leaf = walk_.matrix.tree.leaf_of(node);
    const auto begin = active_[at(walk_.levels())].begin(), end = begin + std::ptrdiff_t(leaves_);
    if (std::find(begin, end, leaf) == end) {
      std::size_t terms = 0;
      for (int level = walk_.levels(); level > 0; --level) terms += at(walk_.rank(walk_.above(leaf, level)));
      if (leaves_ > 0 && (leaves_ == leaves_at_once || terms_ + terms > terms_at_once)) return false;
      active_[at(walk_.levels())][leaves_++] = leaf;
      terms_ += terms;
    }
    sources_[nodes_++] = {leaf, node, f};
    return true;
  }

  void spread() noexcept {
    if (nodes_ == 0) return;
    sort();
    climb();
    double* u = u_.data();
    for (const NodeRange& range : ranges_) {
      first_ = range.first;
      end_ = range.end;
      to_ = u;
      descend(0, 0, false);
      u += std::int64_t{D} * (end_ - first_);
    }
    nodes_ = leaves_ = terms_ = 0;
  }

 private:
  struct Source {
    Index leaf;
    Index node;
    const double* f;
  };

  [[nodiscard]] double* strength(int level, std::size_t slot) noexcept {
    return strengths_.data() + strength_at_[at(level)][slot];
  }

  /// Sorts leaves ascending and sources by leaf.
  void sort() noexcept {
    const auto leaves = active_[at(walk_.levels())].begin();
    std::sort(leaves, leaves + std::ptrdiff_t(leaves_));
    std::sort(sources_.begin(), sources_.begin() + std::ptrdiff_t(nodes_),
              [](const Source& a, const Source& b) {
                return a.leaf < b.leaf || (a.leaf == b.leaf && std::less<>()(a.f, b.f));
              });
    std::size_t k = 0;
    for (std::size_t slot = 0; slot < leaves_; ++slot) {
      source_from_[slot] = k;
      while (k < nodes_ && sources_[k].leaf == leaves[std::ptrdiff_t(slot)]) ++k;
    }
    source_from_[leaves_] = k;
  }

  /// Computes the far field V^T f of each active cluster except the root.
  void climb() noexcept {
    const int L = walk_.levels();
    count_[at(L)] = leaves_;
    if (L == 0) return;
    std::size_t next = 0;
    const auto room = [&](int level, std::size_t slot) {
      strength_at_[at(level)][slot] = next;
      const auto rank = at(walk_.rank(active_[at(level)][slot]));
      std::fill_n(strengths_.data() + next, rank, 0.0);
      next += rank;
    };
    for (std::size_t slot = 0; slot < leaves_; ++slot) {
      room(L, slot);
      const Index leaf = active_[at(L)][slot];
      for (std::size_t k = source_from_[slot]; k < source_from_[slot + 1]; ++k) {
        const std::int64_t first = std::int64_t{D} * (sources_[k].node - walk_.matrix.tree.begin(leaf));
        for (int axis = 0; axis < D; ++axis)
          add(walk_.basis(leaf, first + axis), walk_.matrix.scale * sources_[k].f[axis], strength(L, slot),
              walk_.rank(leaf));
      }
    }
    for (int level = L; level > 1; --level) {
      std::size_t& count = count_[at(level - 1)];
      count = 0;
      for (std::size_t slot = 0; slot < count_[at(level)]; ++slot) {
        const Index c = active_[at(level)][slot], parent = ClusterTree::parent(c);
        if (count == 0 || active_[at(level - 1)][count - 1] != parent) {
          active_[at(level - 1)][count] = parent;
          room(level - 1, count++);
        }
        add_transposed(walk_.transfer(c), walk_.rank(c), walk_.rank(parent), strength(level, slot),
                       strength(level - 1, count - 1));
      }
    }
    count_[0] = 0;  // the root has no far pairs
  }

  /// Calls f(slot, pair) for the partners that are active clusters of the level; both are ascending.
  template <class F>
  void for_each_active(std::span<const Pair> partners, int level, const F& f) noexcept {
    const auto& active = active_[at(level)];
    auto partner = partners.begin();
    for (std::size_t slot = 0; slot < count_[at(level)]; ++slot) {
      while (partner != partners.end() && (*partner)[0] < active[slot]) ++partner;
      if (partner == partners.end()) return;
      if ((*partner)[0] == active[slot]) f(slot, (*partner)[1]);
    }
  }

  /// Adds the displacements in a cluster; `moved` is true if the parent's terms are not zero.
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
    for_each_active(walk_.partners(c), level, [&](std::size_t slot, Index pair) {
      walk_.couple(pair, c, active_[at(level)][slot], strength(level, slot), terms.data());
      moved = true;
    });
    if (level < walk_.levels()) {
      descend(2 * c + 1, level + 1, moved);
      descend(2 * c + 2, level + 1, moved);
      return;
    }
    if (moved) move(c, terms);
    for_each_active(walk_.neighbours(c), level, [&](std::size_t slot, Index pair) { push(c, slot, pair); });
  }

  /// Requested nodes of a leaf: [first, second).
  [[nodiscard]] std::pair<Index, Index> asked(Index leaf) const noexcept {
    const ClusterTree& tree = walk_.matrix.tree;
    return {std::max(tree.begin(leaf), first_), std::min(tree.end(leaf), end_)};
  }

  void move(Index leaf, const Terms& terms) noexcept {
    const auto [from, to] = asked(leaf);
    const Index rank = walk_.rank(leaf);
    double* u = to_ + std::int64_t{D} * (from - first_);
    for (Index node = from; node < to; ++node) {
      const float* V = walk_.basis(leaf, std::int64_t{D} * (node - walk_.matrix.tree.begin(leaf)));
      std::array<const float*, D> rows;
      for (int axis = 0; axis < D; ++axis) rows[at(axis)] = V + std::int64_t{axis} * rank;
      for (const double by_terms : dots<D>(rows, terms.data(), rank)) *u++ += by_terms;
    }
  }

  /// u += rows of a near pair times the forces; several rows at once, so that the sums do not wait for each
  /// other.
  template <std::size_t R>
  void add_rows(const float* rows, std::int64_t width, std::span<const Source> sources,
                double* u) const noexcept {
    std::array<double, R> sum{};
    for (const Source& s : sources) {
      const float* column = rows + std::int64_t{D} * s.node;
      for (int axis = 0; axis < D; ++axis)
        for (std::size_t r = 0; r < R; ++r)
          sum[r] += s.f[axis] * static_cast<double>(column[std::int64_t(r) * width + axis]);
    }
    for (std::size_t r = 0; r < R; ++r) u[r] += walk_.matrix.scale * sum[r];
  }

  /// Adds the displacement by the forces on a near leaf.
  void push(Index leaf, std::size_t slot, Index pair) noexcept {
    const HierarchicalMatrix& m = walk_.matrix;
    const Index other = active_[at(walk_.levels())][slot];
    const auto [from, to] = asked(leaf);
    const auto width_of = [&](Index c) { return std::int64_t{D} * (m.tree.end(c) - m.tree.begin(c)); };
    const std::int64_t first = std::int64_t{D} * (from - m.tree.begin(leaf)),
                       count = std::int64_t{D} * (to - from), before = std::int64_t{D} * m.tree.begin(other);
    const float* entries = m.near.get() + m.near_at[at(pair)];
    double* u = to_ + std::int64_t{D} * (from - first_);
    const std::span<const Source> sources(sources_.data() + source_from_[slot],
                                          sources_.data() + source_from_[slot + 1]);
    if (leaf > other) {  // rows of the pair are rows of u
      const std::int64_t width = width_of(other);
      std::int64_t i = 0;
      for (; i + 4 <= count; i += 4)
        add_rows<4>(entries + (first + i) * width - before, width, sources, u + i);
      for (; i < count; ++i) add_rows<1>(entries + (first + i) * width - before, width, sources, u + i);
      return;
    }
    // Rows of the pair, or of a leaf with itself, are the requested columns.
    const std::int64_t width = width_of(leaf);
    for (const Source& s : sources)
      for (int axis = 0; axis < D; ++axis)
        add(entries + (std::int64_t{D} * s.node - before + axis) * width + first, m.scale * s.f[axis], u,
            static_cast<Index>(count));
  }

  Walk walk_;
  std::span<const NodeRange> ranges_;
  std::span<double> u_;
  Index first_ = 0, end_ = 0;  // the current range
  double* to_ = nullptr;       // its displacement
  std::size_t nodes_ = 0, leaves_ = 0;
  std::size_t terms_ = 0;  // upper bound, over the leaves and all clusters above them
  std::array<Source, nodes_at_once> sources_;
  std::array<std::size_t, leaves_at_once + 1> source_from_;
  std::array<std::size_t, levels_at_most> count_;  // active clusters of a level
  std::array<std::array<Index, leaves_at_once>, levels_at_most> active_;
  std::array<std::array<std::size_t, leaves_at_once>, levels_at_most> strength_at_;
  std::array<double, terms_at_once> strengths_;
  std::array<Terms, levels_at_most> motion_;
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

template <int D>
void displace_dimension(const HierarchicalMatrix& matrix, std::span<const Index> nodes, const double* f,
                        std::span<const NodeRange> ranges, std::span<double> u) noexcept {
  FieldOfLeaves<D> field(matrix, ranges, u);
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
              std::span<const NodeRange> ranges, std::span<double> u) noexcept {
  std::fill(u.begin(), u.end(), 0.0);
  if (matrix.dimension == 2) {
    displace_dimension<2>(matrix, nodes, f.data(), ranges, u);
  } else {
    displace_dimension<3>(matrix, nodes, f.data(), ranges, u);
  }
}

}  // namespace palpate
