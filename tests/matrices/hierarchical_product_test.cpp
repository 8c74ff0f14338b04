// Products with a matrix in nested low-rank form against the same matrix with all entries written out.
#include "matrices/hierarchical_product.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "tests/support/compression/hierarchical_sample.h"

namespace palpate::hierarchical_product_test {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Eigen::VectorXd random_vector(Eigen::Index size, std::mt19937_64& random) {
  return Eigen::VectorXd::NullaryExpr(size, [&] { return test::random_number(random); });
}

class HierarchicalProduct : public testing::TestWithParam<test::HierarchicalKind> {
 protected:
  /// All nodes, shuffled, each of them `times` times.
  std::vector<Index> shuffled_nodes(int times = 1) {
    std::vector<Index> nodes;
    for (int k = 0; k < times; ++k)
      for (Index node = 0; node < matrix_.tree.nodes; ++node) nodes.push_back(node);
    std::shuffle(nodes.begin(), nodes.end(), random_);
    return nodes;
  }
  [[nodiscard]] Rows gathered(Index row, const std::vector<Index>& columns) const {
    Rows blocks = Rows::Constant(d_, d_ * std::ssize(columns), 1e30);
    gather_blocks(matrix_, row, columns, {blocks.data(), static_cast<std::size_t>(blocks.size())});
    return blocks;
  }
  [[nodiscard]] Rows written_blocks(Index row, const std::vector<Index>& columns) const {
    Rows blocks(d_, d_ * std::ssize(columns));
    for (std::size_t k = 0; k < columns.size(); ++k)
      blocks.middleCols(d_ * static_cast<Eigen::Index>(k), d_) =
          full_.block(d_ * row, d_ * columns[k], d_, d_);
    return blocks;
  }
  /// The displacement of `count` nodes from `first` on beside that of the matrix written out.
  void expect_displacement(const std::vector<Index>& nodes, Index first, Index count) {
    const NodeRange all{first, first + count};
    expect_displacement(nodes, {&all, 1}, first, count);
    // In three pieces, the last one first.
    const Index third = first + count / 3, half = first + count / 2;
    const std::array<NodeRange, 4> pieces = {
        {{half, first + count}, {first, third}, {third, third}, {third, half}}};
    expect_displacement(nodes, pieces, first, count);
  }
  void expect_displacement(const std::vector<Index>& nodes, std::span<const NodeRange> ranges, Index first,
                           Index count) {
    const Eigen::VectorXd f = random_vector(d_ * std::ssize(nodes), random_);
    Eigen::VectorXd expected = Eigen::VectorXd::Zero(d_ * count);
    for (std::size_t k = 0; k < nodes.size(); ++k)
      expected += full_.block(d_ * first, d_ * nodes[k], d_ * count, d_) *
                  f.segment(d_ * static_cast<Eigen::Index>(k), d_);
    Eigen::VectorXd u = Eigen::VectorXd::Constant(d_ * count + 2, 1e30);
    displace(matrix_, nodes, {f.data(), static_cast<std::size_t>(f.size())}, ranges,
             {u.data() + 1, static_cast<std::size_t>(d_ * count)});
    EXPECT_EQ(u[0], 1e30);
    EXPECT_EQ(u[d_ * count + 1], 1e30);
    Eigen::VectorXd in_place = Eigen::VectorXd::Constant(d_ * count, 1e30);
    Eigen::Index from = 1;
    for (const NodeRange& range : ranges) {
      const Eigen::Index length = d_ * (range.end - range.first);
      in_place.segment(d_ * (range.first - first), length) = u.segment(from, length);
      from += length;
    }
    ASSERT_LE((in_place - expected).norm(), 1e-14 * full_.norm() * std::max(f.norm(), 1.0))
        << nodes.size() << " nodes with force, " << count << " from " << first << " on";
  }

  HierarchicalMatrix matrix_ = test::random_hierarchical(GetParam(), 7);
  Eigen::MatrixXd full_ = test::written_out(matrix_);
  Eigen::Index d_ = GetParam().dimension;
  double rounding_ = 1e-14 * full_.cwiseAbs().maxCoeff() * std::max<double>(1.0, GetParam().largest_rank);
  std::mt19937_64 random_{11};
};

TEST_P(HierarchicalProduct, HasAnEntryForEveryPairOfDofs) {
  EXPECT_TRUE(full_.allFinite());
  EXPECT_EQ(full_, Eigen::MatrixXd(full_.transpose()));
}

TEST_P(HierarchicalProduct, GatherIsABlockOfTheMatrix) {
  for (const Index row : shuffled_nodes()) {
    for (const Index column : {row, Index{0}, matrix_.tree.nodes - 1, matrix_.tree.nodes / 2})
      ASSERT_LE((gathered(row, {column}) - written_blocks(row, {column})).cwiseAbs().maxCoeff(), rounding_)
          << row << ", " << column;
    if (row % 7 != 0) continue;
    std::vector<Index> columns(static_cast<std::size_t>(matrix_.tree.nodes));
    std::iota(columns.begin(), columns.end(), 0);
    ASSERT_LE((gathered(row, columns) - written_blocks(row, columns)).cwiseAbs().maxCoeff(), rounding_)
        << row;
  }
}

// More leaves than a row remembers, in an order in which each is forgotten and needed again.
TEST_P(HierarchicalProduct, GatherOfColumnsThatJumpFromLeafToLeaf) {
  const std::vector<Index> columns = shuffled_nodes(2);
  for (Index row = 0; row < matrix_.tree.nodes; row += 1 + matrix_.tree.nodes / 9)
    ASSERT_LE((gathered(row, columns) - written_blocks(row, columns)).cwiseAbs().maxCoeff(), rounding_)
        << row;
}

TEST_P(HierarchicalProduct, GatherOfNoColumnsWritesNothing) {
  double untouched = 7.0;
  gather_blocks(matrix_, 0, {}, {&untouched, 0});
  EXPECT_EQ(untouched, 7.0);
}

TEST_P(HierarchicalProduct, DisplacementIsTheProduct) {
  const Index nodes = matrix_.tree.nodes;
  expect_displacement({}, 0, nodes);
  for (Index node = 0; node < nodes; node += 1 + nodes / 40) expect_displacement({node}, 0, nodes);
  const std::vector<Index> all = shuffled_nodes();
  expect_displacement({all.begin(), all.begin() + std::min<std::ptrdiff_t>(30, nodes)}, 0, nodes);
  expect_displacement(all, 0, nodes);
}

// Nodes of one leaf beyond the room for them, and a node more than once.
TEST_P(HierarchicalProduct, DisplacementByMoreForcesThanAreKept) {
  expect_displacement(std::vector<Index>(600, matrix_.tree.nodes / 3), 0, matrix_.tree.nodes);
  std::vector<Index> most = shuffled_nodes(1 + 300 / matrix_.tree.nodes);
  std::sort(most.begin(), most.end());
  expect_displacement(most, 0, matrix_.tree.nodes);
}

TEST_P(HierarchicalProduct, DisplacementOfAPart) {
  const std::vector<Index> all = shuffled_nodes();
  const auto pick = [this](Index end) { return static_cast<Index>(random_() % std::uint64_t(end)); };
  for (int part = 0; part < 60; ++part) {
    const Index first = pick(matrix_.tree.nodes), count = pick(matrix_.tree.nodes - first + 1);
    const auto loaded = std::min<std::ptrdiff_t>(std::ssize(all), 1 + pick(20));
    expect_displacement({all.begin(), all.begin() + loaded}, first, count);
  }
  expect_displacement(all, matrix_.tree.nodes - 1, 1);
  expect_displacement(all, 0, 1);
}

TEST_P(HierarchicalProduct, IsSymmetric) {
  const Index nodes = matrix_.tree.nodes;
  for (Index a = 0; a < nodes; a += 1 + nodes / 30) {
    for (Index b = 0; b < nodes; b += 1 + nodes / 30)
      ASSERT_LE((gathered(a, {b}) - gathered(b, {a}).transpose()).cwiseAbs().maxCoeff(), rounding_)
          << a << ", " << b;
  }
}

TEST_P(HierarchicalProduct, PartnersAreSeenFromBothSides) {
  const auto expect_partners = [](const std::vector<HierarchicalMatrix::Pair>& pairs, Index first,
                                  const std::vector<std::int64_t>& from,
                                  const std::vector<HierarchicalMatrix::Pair>& partners) {
    std::vector<std::vector<HierarchicalMatrix::Pair>> expected(from.size() - 1);
    for (std::size_t p = 0; p < pairs.size(); ++p) {
      const auto [row, column] = pairs[p];
      expected[static_cast<std::size_t>(row - first)].push_back({column, static_cast<Index>(p)});
      if (row != column)
        expected[static_cast<std::size_t>(column - first)].push_back({row, static_cast<Index>(p)});
    }
    for (std::size_t c = 0; c + 1 < from.size(); ++c) {
      std::sort(expected[c].begin(), expected[c].end());
      EXPECT_EQ(std::vector(partners.begin() + from[c], partners.begin() + from[c + 1]), expected[c]) << c;
    }
    EXPECT_EQ(from.back(), std::ssize(partners));
  };
  expect_partners(matrix_.far_pair, 0, matrix_.partner_from, matrix_.partner);
  expect_partners(matrix_.near_pair, matrix_.tree.first_leaf(), matrix_.near_from, matrix_.neighbour);
}

TEST_P(HierarchicalProduct, BytesAreThoseOfTheEntries) {
  std::int64_t entries = 0;
  const auto dofs = [&](Index c) { return d_ * (matrix_.tree.end(c) - matrix_.tree.begin(c)); };
  const auto rank = [&](Index c) { return std::int64_t{matrix_.rank[static_cast<std::size_t>(c)]}; };
  for (Index c = 0; c < matrix_.tree.clusters(); ++c) {
    if (c >= matrix_.tree.first_leaf()) entries += dofs(c) * rank(c);
    if (c > 0) entries += rank(c) * rank(ClusterTree::parent(c));
  }
  for (const auto& [row, column] : matrix_.far_pair) entries += rank(row) * rank(column);
  for (const auto& [row, column] : matrix_.near_pair) entries += dofs(row) * dofs(column);
  EXPECT_EQ(matrix_.bytes(), 4 * entries);
}

std::string case_name(const testing::TestParamInfo<test::HierarchicalKind>& info) {
  return std::to_string(info.param.dimension) + "d_" + std::to_string(info.param.nodes) + "_nodes_" +
         std::to_string(info.param.levels) + "_levels_rank_" + std::to_string(info.param.largest_rank);
}

// Leaves of one node and more leaves than both caches hold, the largest rank, odd numbers of nodes.
INSTANTIATE_TEST_SUITE_P(
    Kinds, HierarchicalProduct,
    testing::Values(test::HierarchicalKind{.dimension = 3, .nodes = 1, .levels = 0},
                    test::HierarchicalKind{.dimension = 2, .nodes = 9, .levels = 0, .scale = 3.0},
                    test::HierarchicalKind{.dimension = 2, .nodes = 64, .levels = 6, .largest_rank = 2},
                    test::HierarchicalKind{.dimension = 3, .nodes = 37, .levels = 2, .scale = -0.25},
                    test::HierarchicalKind{.dimension = 2, .nodes = 331, .levels = 5, .scale = 1e-6},
                    test::HierarchicalKind{.dimension = 3, .nodes = 331, .levels = 6, .scale = 1e3},
                    test::HierarchicalKind{.dimension = 3, .nodes = 200, .levels = 3, .largest_rank = 0},
                    test::HierarchicalKind{
                        .dimension = 3, .nodes = 97, .levels = 3, .largest_rank = most_rank}),
    case_name);

}  // namespace
}  // namespace palpate::hierarchical_product_test
