#include "formats/hierarchical_fields.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

using Pair = HierarchicalMatrix::Pair;

bool by_column(const Pair& a, const Pair& b) {
  return a[1] != b[1] ? a[1] < b[1] : a[0] < b[0];
}

std::vector<Pair> pairs_of(const std::vector<std::int32_t>& values) {
  std::vector<Pair> pairs(values.size() / 2);
  for (std::size_t k = 0; k < pairs.size(); ++k) pairs[k] = {values[2 * k], values[2 * k + 1]};
  return pairs;
}

void refuse_negative(const std::vector<double>& values) {
  if (!std::all_of(values.begin(), values.end(), [](double v) { return v >= 0.0 && std::isfinite(v); }))
    throw Unreadable{"holds a number that is negative or not finite"};
}

/// Checks that pairs are of clusters in [first, end), with the row on the column's level and not before it,
/// each pair once.
void check_pairs(const std::vector<Pair>& pairs, Index first, Index end, bool with_itself,
                 const std::string& path, const std::string& where) {
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto [row, column] = pairs[k];
    const std::string entry = path + ": pair " + std::to_string(k);
    if (column < first || row >= end || row < column || (row == column && !with_itself) ||
        ClusterTree::level(row) != ClusterTree::level(column))
      refuse(where, entry + " is " + std::to_string(row) + ", " + std::to_string(column) +
                        ", which are not two clusters of one level");
    if (k > 0 && !by_column(pairs[k - 1], pairs[k])) refuse(where, entry + " is not after the one before");
  }
}

/// Walk down the file's pairs of clusters that counts the pairs it meets.
struct Cover {
  const HierarchicalMatrix& matrix;
  std::size_t far = 0, near = 0;

  [[nodiscard]] static bool has(const std::vector<Pair>& pairs, const Pair& pair) {
    return std::binary_search(pairs.begin(), pairs.end(), pair, by_column);
  }
  /// Visits a pair a >= b; false if the entries of some pair of leaves are missing.
  bool visit(Index a, Index b) {
    if (a != b && has(matrix.far_pair, {a, b})) {
      ++far;
      return true;
    }
    if (a >= matrix.tree.first_leaf()) {
      ++near;
      return has(matrix.near_pair, {a, b});
    }
    return visit(2 * a + 1, 2 * b + 1) && visit(2 * a + 2, 2 * b + 1) &&
           (a == b || visit(2 * a + 1, 2 * b + 2)) && visit(2 * a + 2, 2 * b + 2);
  }
};

}  // namespace

HierarchicalMatrix& compressed_to_fill(Model& model) {
  auto matrix = std::make_shared<HierarchicalMatrix>();
  if (model.compressed != nullptr) *matrix = *model.compressed;
  model.compressed = matrix;
  return *matrix;
}

std::vector<std::int32_t> flat_pairs(const std::vector<Pair>& pairs) {
  std::vector<std::int32_t> values;
  values.reserve(2 * pairs.size());
  for (const Pair& pair : pairs) values.insert(values.end(), pair.begin(), pair.end());
  return values;
}

void put_levels(Model& model, const std::vector<std::int32_t>& values) {
  HierarchicalMatrix& matrix = compressed_to_fill(model);
  const auto nodes = static_cast<Index>(model.stored_nodes.size());
  const int levels = values.front();
  if (levels < 0 || levels > most_levels || (nodes >> levels) == 0)
    throw Unreadable{"is " + std::to_string(levels) + ", which does not fit " + std::to_string(nodes) +
                     " stored nodes"};
  matrix.dimension = model.dimension();
  matrix.tree = {nodes, levels};
}

void put_tolerance(Model& model, const std::vector<double>& values) {
  if (!(values.front() > 0.0)) throw Unreadable{"is " + std::to_string(values.front())};
  compressed_to_fill(model).tolerance = values.front();
}

void put_near_pairs(Model& model, const std::vector<std::int32_t>& values) {
  compressed_to_fill(model).near_pair = pairs_of(values);
}

void put_far_pairs(Model& model, const std::vector<std::int32_t>& values) {
  compressed_to_fill(model).far_pair = pairs_of(values);
}

void put_ranks(Model& model, const std::vector<std::int32_t>& values) {
  compressed_to_fill(model).rank.assign(values.begin(), values.end());
}

void put_pair_errors(Model& model, const std::vector<double>& values) {
  refuse_negative(values);
  compressed_to_fill(model).pair_error = values;
}

void put_certificate(Model& model, const std::vector<double>& values) {
  refuse_negative(values);
  compressed_to_fill(model).certificate = values;
}

void count_tree(const HierarchicalMatrix& matrix, Counts& counts) {
  counts.set(Count::near_pairs, std::ssize(matrix.near_pair), "/greens/near_pairs");
  counts.set(Count::far_pairs, std::ssize(matrix.far_pair), "/greens/far_pairs");
  counts.set(Count::clusters, matrix.tree.clusters(), tree_path);
  counts.set(Count::certified, std::ssize(matrix.certificate) / 6, "/greens/certificate");
}

void check_tree(const Model& model, const std::string& where) {
  const HierarchicalMatrix& matrix = *model.compressed;
  const ClusterTree& tree = matrix.tree;
  check_pairs(matrix.near_pair, tree.first_leaf(), tree.clusters(), true, "/greens/near_pairs", where);
  check_pairs(matrix.far_pair, 0, tree.clusters(), false, "/greens/far_pairs", where);
  Cover cover{matrix};
  if (!cover.visit(0, 0) || cover.near != matrix.near_pair.size() || cover.far != matrix.far_pair.size())
    refuse(where, "/greens/near_pairs and /greens/far_pairs do not have every pair of leaves once");
}

void check_ranks(const Model& model, const std::string& where) {
  const HierarchicalMatrix& matrix = *model.compressed;
  if (std::ssize(matrix.rank) != matrix.tree.clusters())
    refuse(where, "/greens/ranks has " + std::to_string(matrix.rank.size()) + " entries, the tree has " +
                      std::to_string(matrix.tree.clusters()) + " clusters");
}

}  // namespace palpate
