#include "matrices/hierarchical.h"

#include <algorithm>
#include <numeric>

namespace palpate {
namespace {

/// Lists each pair at both of its clusters; a pair of a cluster with itself once.
void list_partners(const std::vector<HierarchicalMatrix::Pair>& pairs, Index first, Index count,
                   std::vector<std::int64_t>& from, std::vector<HierarchicalMatrix::Pair>& partners) {
  const auto of = [first](Index cluster) { return static_cast<std::size_t>(cluster - first); };
  from.assign(static_cast<std::size_t>(count) + 1, 0);
  for (const auto& [row, column] : pairs) {
    ++from[of(row) + 1];
    if (row != column) ++from[of(column) + 1];
  }
  std::partial_sum(from.begin(), from.end(), from.begin());
  partners.resize(static_cast<std::size_t>(from.back()));
  std::vector<std::int64_t> next = from;
  // By columns: a cluster is first the row of its pairs with earlier clusters, then the column of the others.
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const auto [row, column] = pairs[p];
    partners[static_cast<std::size_t>(next[of(row)]++)] = {column, static_cast<Index>(p)};
    if (row != column) partners[static_cast<std::size_t>(next[of(column)]++)] = {row, static_cast<Index>(p)};
  }
}

}  // namespace

std::int64_t HierarchicalMatrix::bytes() const noexcept {
  return (basis_at.back() + transfer_at.back() + coupling_at.back() + near_at.back()) *
         static_cast<std::int64_t>(sizeof(float));
}

std::int64_t HierarchicalMatrix::first_near_pair(Index leaf) const noexcept {
  const Index cluster = tree.first_leaf() + leaf;
  return std::lower_bound(near_pair.begin(), near_pair.end(), cluster,
                          [](const Pair& pair, Index c) { return pair[1] < c; }) -
         near_pair.begin();
}

void HierarchicalMatrix::index() {
  const auto at = [](Index i) { return static_cast<std::size_t>(i); };
  const Index leaves = tree.leaves(), clusters = tree.clusters(), first_leaf = tree.first_leaf();
  const auto dofs = [this](Index cluster) {
    return std::int64_t{dimension} * (tree.end(cluster) - tree.begin(cluster));
  };
  basis_at.assign(at(leaves) + 1, 0);
  for (Index leaf = 0; leaf < leaves; ++leaf)
    basis_at[at(leaf) + 1] = basis_at[at(leaf)] + dofs(first_leaf + leaf) * rank[at(first_leaf + leaf)];
  transfer_at.assign(at(clusters) + 1, 0);
  for (Index c = 0; c < clusters; ++c) {
    const std::int64_t above = c == 0 ? 0 : rank[at(ClusterTree::parent(c))];
    transfer_at[at(c) + 1] = transfer_at[at(c)] + rank[at(c)] * above;
  }
  coupling_at.assign(1, 0);
  for (const auto& [row, column] : far_pair)
    coupling_at.push_back(coupling_at.back() + std::int64_t{rank[at(row)]} * rank[at(column)]);
  near_at.assign(1, 0);
  for (const auto& [row, column] : near_pair) near_at.push_back(near_at.back() + dofs(row) * dofs(column));
  list_partners(far_pair, 0, clusters, partner_from, partner);
  list_partners(near_pair, first_leaf, leaves, near_from, neighbour);
}

}  // namespace palpate
