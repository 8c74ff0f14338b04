#include "tests/support/compression/hierarchical_sample.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate::test {
namespace {

using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

std::size_t place(std::int64_t i) {
  return static_cast<std::size_t>(i);
}

/// The pair of two clusters of a level is far, near or cut into those of their children, by chance.
void choose_pairs(HierarchicalMatrix& matrix, Index a, Index b, std::mt19937_64& random) {
  const bool leaf = a >= matrix.tree.first_leaf();
  if (a != b && ClusterTree::level(a) > 1 && random() % 3 == 0) {
    matrix.far_pair.push_back({a, b});
  } else if (leaf) {
    matrix.near_pair.push_back({a, b});
  } else {
    choose_pairs(matrix, 2 * a + 1, 2 * b + 1, random);
    choose_pairs(matrix, 2 * a + 2, 2 * b + 1, random);
    if (a != b) choose_pairs(matrix, 2 * a + 1, 2 * b + 2, random);
    choose_pairs(matrix, 2 * a + 2, 2 * b + 2, random);
  }
}

/// Numbers that neither grow nor fade in sums of `terms` products.
std::shared_ptr<const float[]> random_entries(std::int64_t count, Index terms, std::mt19937_64& random) {
  const std::shared_ptr<float[]> entries(new float[place(std::max<std::int64_t>(count, 1))]);
  const double size = 1.0 / std::sqrt(std::max(1.0, static_cast<double>(terms)));
  for (std::int64_t k = 0; k < count; ++k) entries[k] = static_cast<float>(size * random_number(random));
  return entries;
}

/// Near pairs of a leaf with itself are symmetric.
void mirror_diagonal(const HierarchicalMatrix& matrix, float* near) {
  for (std::size_t p = 0; p < matrix.near_pair.size(); ++p) {
    const auto [row, column] = matrix.near_pair[p];
    if (row != column) continue;
    const Eigen::Index n = matrix.dimension * (matrix.tree.end(row) - matrix.tree.begin(row));
    Eigen::Map<FloatRows> block(near + matrix.near_at[p], n, n);
    block.triangularView<Eigen::StrictlyUpper>() = block.transpose();
  }
}

Eigen::MatrixXd V_of(const HierarchicalMatrix& matrix, Index cluster) {
  const Index rank = matrix.rank[place(cluster)];
  const Eigen::Index dofs = matrix.dimension * (matrix.tree.end(cluster) - matrix.tree.begin(cluster));
  if (cluster >= matrix.tree.first_leaf()) {
    const float* V = matrix.basis.get() + matrix.basis_at[place(cluster - matrix.tree.first_leaf())];
    return Eigen::Map<const FloatRows>(V, dofs, rank).cast<double>();
  }
  Eigen::MatrixXd V(dofs, rank);
  Eigen::Index row = 0;
  for (const Index child : {2 * cluster + 1, 2 * cluster + 2}) {
    const Eigen::MatrixXd below = V_of(matrix, child);
    const Eigen::Map<const FloatRows> E(matrix.transfer.get() + matrix.transfer_at[place(child)],
                                        matrix.rank[place(child)], rank);
    V.middleRows(row, below.rows()) = below * E.cast<double>();
    row += below.rows();
  }
  return V;
}

}  // namespace

double random_number(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-52 - 1.0;
}

HierarchicalMatrix random_hierarchical(const HierarchicalKind& kind, unsigned seed) {
  std::mt19937_64 random(seed);
  HierarchicalMatrix matrix;
  matrix.dimension = kind.dimension;
  matrix.tree = {kind.nodes, kind.levels};
  matrix.scale = kind.scale;
  choose_pairs(matrix, 0, 0, random);
  const auto by_column = [](const HierarchicalMatrix::Pair& a, const HierarchicalMatrix::Pair& b) {
    return std::pair(a[1], a[0]) < std::pair(b[1], b[0]);
  };
  std::sort(matrix.near_pair.begin(), matrix.near_pair.end(), by_column);
  std::sort(matrix.far_pair.begin(), matrix.far_pair.end(), by_column);
  std::vector<bool> needed(place(matrix.tree.clusters()), false);
  for (const auto& [row, column] : matrix.far_pair) needed[place(row)] = needed[place(column)] = true;
  for (Index c = 1; c < matrix.tree.clusters(); ++c)
    if (needed[place(ClusterTree::parent(c))]) needed[place(c)] = true;
  for (Index c = 0; c < matrix.tree.clusters(); ++c) {
    const auto rank = static_cast<Index>(random() % static_cast<std::uint64_t>(kind.largest_rank + 1));
    matrix.rank.push_back(needed[place(c)] ? rank : 0);
  }
  matrix.index();
  matrix.basis = random_entries(matrix.basis_at.back(), kind.largest_rank, random);
  matrix.transfer = random_entries(matrix.transfer_at.back(), kind.largest_rank, random);
  matrix.coupling = random_entries(matrix.coupling_at.back(), 1, random);
  matrix.near = random_entries(matrix.near_at.back(), 1, random);
  mirror_diagonal(matrix, const_cast<float*>(matrix.near.get()));  // made above
  for (std::size_t p = 0; p < matrix.far_pair.size(); ++p)
    matrix.pair_error.push_back(1.0 + random_number(random));
  return matrix;
}

Eigen::MatrixXd written_out(const HierarchicalMatrix& matrix) {
  const Eigen::Index d = matrix.dimension;
  Eigen::MatrixXd full =
      Eigen::MatrixXd::Constant(matrix.order(), matrix.order(), std::numeric_limits<double>::quiet_NaN());
  const auto put = [&](Index row, Index column, const Eigen::MatrixXd& block) {
    const Eigen::Index i = d * matrix.tree.begin(row), j = d * matrix.tree.begin(column);
    full.block(i, j, block.rows(), block.cols()) = matrix.scale * block;
    full.block(j, i, block.cols(), block.rows()) = matrix.scale * block.transpose();
  };
  for (std::size_t p = 0; p < matrix.far_pair.size(); ++p) {
    const auto [row, column] = matrix.far_pair[p];
    const Eigen::Map<const FloatRows> S(matrix.coupling.get() + matrix.coupling_at[p],
                                        matrix.rank[place(row)], matrix.rank[place(column)]);
    put(row, column, V_of(matrix, row) * S.cast<double>() * V_of(matrix, column).transpose());
  }
  for (std::size_t p = 0; p < matrix.near_pair.size(); ++p) {
    const auto [row, column] = matrix.near_pair[p];
    const auto width = [&](Index c) { return d * (matrix.tree.end(c) - matrix.tree.begin(c)); };
    const Eigen::Map<const FloatRows> block(matrix.near.get() + matrix.near_at[p], width(row), width(column));
    put(row, column, block.cast<double>());
  }
  return full;
}

}  // namespace palpate::test
