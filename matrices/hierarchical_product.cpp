#include "matrices/hierarchical_product.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <utility>

#include "matrices/hierarchical_walk.h"

namespace palpate {
namespace {
using namespace nested;

constexpr std::size_t leaves_at_once = 64;    // leaves that carry force
constexpr std::size_t nodes_at_once = 256;    // of those leaves
constexpr std::size_t terms_at_once = 16384;  // of those leaves and all above them: on the stack

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
      for_each_product<1>(walk_.transfer(c), walk_.rank(c), walk_.rank(ClusterTree::parent(c)),
                          {motion_[at(level - 1)].data()},
                          [&](Index term, const std::array<double, 1>& sum) { terms[at(term)] = sum[0]; });
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
      const auto by_terms = products<D, 1>(rows_from<D>(V, rank), {terms.data()}, rank);
      for (std::size_t axis = 0; axis < D; ++axis) *u++ += by_terms[0][axis];
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
    for (const Source& s : sources) {
      for (int axis = 0; axis < D; ++axis)
        add(entries + (std::int64_t{D} * s.node - before + axis) * width + first, m.scale * s.f[axis], u,
            static_cast<Index>(count));
    }
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
