#include "matrices/error_bound.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace palpate {
namespace {

constexpr double deviations = 24.0;

std::size_t at(std::int64_t i) noexcept {
  return static_cast<std::size_t>(i);
}

}  // namespace

ErrorBound::ErrorBound(const HierarchicalMatrix& matrix, std::size_t most_nodes)
    : matrix_(&matrix), places_(most_nodes), sorted_nodes_(most_nodes) {
  for (Load* load : {&carried_, &tried_}) load->clusters.resize(most_nodes * at(matrix.tree.levels + 1));
}

void ErrorBound::carry(std::span<const Index> nodes, std::span<const double> f) noexcept {
  weigh(nodes, f, carried_);
  stays_near_ = mean_square(carried_, carried_) == 0.0;
}

double ErrorBound::work(std::span<const Index> nodes, std::span<const double> y) noexcept {
  const bool on_the_same = std::ranges::equal(nodes, std::span(sorted_nodes_).first(sorted_));
  if (on_the_same && stays_near_) return 0.0;
  stays_near_ = stays_near_ && on_the_same;  // from now on other nodes are sorted
  weigh(nodes, y, tried_);
  return deviations * std::sqrt(mean_square(tried_, carried_));
}

double ErrorBound::mean_square(const Load& y, const Load& f) const noexcept {
  double sum = 0.0;
  for (int level = 1; level <= matrix_->tree.levels; ++level) {
    for (const auto& [cluster, squared] : y.level(level)) {
      auto partner = matrix_->partner.begin() + matrix_->partner_from[at(cluster)];
      const auto end = matrix_->partner.begin() + matrix_->partner_from[at(cluster) + 1];
      for (const Loaded& other : f.level(level)) {
        while (partner != end && (*partner)[0] < other.cluster) ++partner;
        if (partner == end) break;
        if ((*partner)[0] == other.cluster) sum += mean_square((*partner)[1]) * squared * other.squared;
      }
    }
  }
  return sum;
}

double ErrorBound::mean_square(Index pair) const noexcept {
  const auto [row, column] = matrix_->far_pair[at(pair)];
  const auto dofs = [this](Index c) {
    return static_cast<double>(matrix_->dimension * (matrix_->tree.end(c) - matrix_->tree.begin(c)));
  };
  const double error = matrix_->pair_error[at(pair)];
  return error * error / (dofs(row) * dofs(column));
}

/// Finds the leaves that carry force, and the clusters above them.
void ErrorBound::weigh(std::span<const Index> nodes, std::span<const double> f, Load& load) noexcept {
  const ClusterTree& tree = matrix_->tree;
  nodes = nodes.first(std::min(nodes.size(), places_.size()));
  const std::span<Index> places = std::span(places_).first(nodes.size());
  if (!std::ranges::equal(nodes, std::span(sorted_nodes_).first(sorted_))) {
    std::iota(places.begin(), places.end(), 0);
    std::sort(places.begin(), places.end(), [&](Index a, Index b) { return nodes[at(a)] < nodes[at(b)]; });
    std::copy(nodes.begin(), nodes.end(), sorted_nodes_.begin());
    sorted_ = nodes.size();
  }
  std::size_t next = 0;
  for (std::size_t k = 0; k < places.size();) {
    const Index leaf = tree.leaf_of(nodes[at(places[k])]);
    const std::size_t first = k;
    while (k < places.size() && nodes[at(places[k])] < tree.end(leaf)) ++k;
    load.clusters[next++] = {leaf, squared_of_leaf(leaf, places.subspan(first, k - first), nodes, f)};
  }
  std::size_t begin = 0;
  for (int level = tree.levels; level > 0; --level) {
    const std::size_t end = next;
    load.range[at(level)] = {begin, end};
    for (std::size_t k = begin; k < end; ++k) {
      const auto [cluster, squared] = load.clusters[k];
      const Index parent = ClusterTree::parent(cluster);
      if (next > end && load.clusters[next - 1].cluster == parent) {
        load.clusters[next - 1].squared += squared;
      } else {
        load.clusters[next++] = {parent, squared};
      }
    }
    begin = end;
  }
}

/// f^T Xi f for the forces on a leaf.
double ErrorBound::squared_of_leaf(Index leaf, std::span<const Index> places, std::span<const Index> nodes,
                                   std::span<const double> f) const noexcept {
  const ClusterTree& tree = matrix_->tree;
  const int d = matrix_->dimension;
  const std::int64_t width = std::int64_t{d} * (tree.end(leaf) - tree.begin(leaf));
  const float* near =
      matrix_->near.get() + matrix_->near_at[at(matrix_->first_near_pair(leaf - tree.first_leaf()))];
  double sum = 0.0;
  for (std::size_t k = 0; k < places.size(); ++k) {
    const Index i = places[k];
    for (int a = 0; a < d; ++a) {
      const float* row = near + (std::int64_t{d} * (nodes[at(i)] - tree.begin(leaf)) + a) * width;
      const auto u_by = [&](Index j) {
        const float* entry = row + std::int64_t{d} * (nodes[at(j)] - tree.begin(leaf));
        double u = 0.0;
        for (int b = 0; b < d; ++b) u += double{entry[b]} * f[at(std::int64_t{d} * j + b)];
        return u;
      };
      double u = 0.0;  // the block is symmetric: nodes after i count twice
      for (const Index j : places.subspan(k + 1)) u += u_by(j);
      sum += f[at(std::int64_t{d} * i + a)] * (u_by(i) + 2.0 * u);
    }
  }
  return std::max(matrix_->scale * sum, 0.0);
}

}  // namespace palpate
