// The tree of clusters and its pairs against what their definitions say, node by node.
#include "precompute/compression/cluster_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "precompute/numerics/touches.h"

namespace palpate::cluster_pairs_test {
namespace {

std::vector<Vec3> cloud(Index count, const Vec3& size, std::uint64_t seed = 1) {
  std::mt19937_64 random(seed);
  std::vector<Vec3> points;
  for (Index k = 0; k < count; ++k)
    points.emplace_back(size.x() * uniform(random), size.y() * uniform(random), size.z() * uniform(random));
  return points;
}

/// Points of a grid with x fastest: many of them have a coordinate in common.
std::vector<Vec3> grid(int nx, int ny, int nz, double step = 1.0) {
  std::vector<Vec3> points;
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x) points.push_back(step * Vec3(x, y, z));
  return points;
}

struct Box {
  Vec3 low = Vec3::Constant(1e300), high = Vec3::Constant(-1e300);
};

Box box_of(const ClusteredNodes& nodes, const std::vector<Vec3>& points, Index cluster) {
  Box box;
  for (Index k = nodes.tree.begin(cluster); k < nodes.tree.end(cluster); ++k) {
    const Vec3& x = points[static_cast<std::size_t>(nodes.order[static_cast<std::size_t>(k)])];
    box.low = box.low.cwiseMin(x);
    box.high = box.high.cwiseMax(x);
  }
  return box;
}

/// Diameter over distance, of boxes; infinity where they touch.
double nearness(const Box& a, const Box& b) {
  const double diameter = std::max((a.high - a.low).norm(), (b.high - b.low).norm());
  Vec3 gap;
  for (int axis = 0; axis < 3; ++axis)
    gap[axis] = std::max({0.0, a.low[axis] - b.high[axis], b.low[axis] - a.high[axis]});
  return gap.norm() > 0.0 ? diameter / gap.norm() : std::numeric_limits<double>::infinity();
}

/// Everything that the header promises of the clusters of these points.
void expect_clusters(const std::vector<Vec3>& points, const ClusterOptions& options) {
  const ClusteredNodes nodes = cluster_nodes(points, options);
  const auto N = static_cast<Index>(points.size());
  ASSERT_EQ(nodes.tree.nodes, N);
  std::vector<Index> all(points.size());
  std::iota(all.begin(), all.end(), 0);
  EXPECT_TRUE(std::is_permutation(nodes.order.begin(), nodes.order.end(), all.begin(), all.end()));
  for (Index leaf = nodes.tree.first_leaf(); leaf < nodes.tree.clusters(); ++leaf) {
    EXPECT_GT(nodes.tree.end(leaf), nodes.tree.begin(leaf)) << "an empty leaf";
    EXPECT_LE(nodes.tree.end(leaf) - nodes.tree.begin(leaf), options.leaf + 1);
    EXPECT_TRUE(std::is_sorted(nodes.order.begin() + nodes.tree.begin(leaf),
                               nodes.order.begin() + nodes.tree.end(leaf)));
  }
  // Each pair of nodes, both ways round.
  std::vector<int> pairs(points.size() * points.size(), 0);
  const auto count = [&](Index a, Index b) {
    for (Index i = nodes.tree.begin(a); i < nodes.tree.end(a); ++i)
      for (Index j = nodes.tree.begin(b); j < nodes.tree.end(b); ++j)
        ++pairs[static_cast<std::size_t>(i) * points.size() + static_cast<std::size_t>(j)];
  };
  for (const auto& [a, b] : nodes.near_pair) {
    EXPECT_GE(b, nodes.tree.first_leaf());
    EXPECT_GE(a, b);
    count(a, b);
    if (a != b) count(b, a);
  }
  for (const auto& [a, b] : nodes.far_pair) {
    EXPECT_GT(a, b);
    EXPECT_EQ(ClusterTree::level(a), ClusterTree::level(b));
    EXPECT_LE(nearness(box_of(nodes, points, a), box_of(nodes, points, b)), options.eta * (1 + 1e-8));
    EXPECT_GT(nearness(box_of(nodes, points, ClusterTree::parent(a)),
                       box_of(nodes, points, ClusterTree::parent(b))),
              options.eta * (1 - 1e-8))
        << "the parents were far already";
    count(a, b);
    count(b, a);
  }
  for (const auto& [a, b] : nodes.near_pair) {
    if (a == b) continue;
    EXPECT_GT(nearness(box_of(nodes, points, a), box_of(nodes, points, b)), options.eta * (1 - 1e-8));
  }
  EXPECT_EQ(std::count(pairs.begin(), pairs.end(), 1), std::ssize(pairs));
  const auto by_columns = [](const auto& a, const auto& b) {
    return a[1] < b[1] || (a[1] == b[1] && a[0] < b[0]);
  };
  EXPECT_TRUE(std::is_sorted(nodes.near_pair.begin(), nodes.near_pair.end(), by_columns));
  EXPECT_TRUE(std::is_sorted(nodes.far_pair.begin(), nodes.far_pair.end(), by_columns));
}

TEST(ClusterTree, ClustersOfALevelShareTheNodesByTheFloorFormula) {
  for (const Index N : {1, 2, 3, 7, 64, 65, 127, 1000, 17742, 2000003}) {
    for (int L = 0; L <= 10; ++L) {
      const ClusterTree tree{N, L};
      ASSERT_EQ(tree.leaves(), 1 << L);
      ASSERT_EQ(tree.clusters(), 2 * (1 << L) - 1);
      Index c = 0;
      for (int level = 0; level <= L; ++level) {
        ASSERT_EQ(tree.first_of_level(level), c);
        for (std::int64_t i = 0; i < 1 << level; ++i, ++c) {
          ASSERT_EQ(ClusterTree::level(c), level);
          ASSERT_EQ(tree.begin(c), i * N / (1 << level)) << N << ", " << L;
          ASSERT_EQ(tree.end(c), (i + 1) * N / (1 << level));
          if (level == L) continue;
          ASSERT_EQ(ClusterTree::parent(2 * c + 1), c);
          ASSERT_EQ(ClusterTree::parent(2 * c + 2), c);
          ASSERT_EQ(tree.begin(2 * c + 1), tree.begin(c)) << N << ", " << L;
          ASSERT_EQ(tree.end(2 * c + 1), tree.begin(2 * c + 2));
          ASSERT_EQ(tree.end(2 * c + 2), tree.end(c));
        }
      }
      ASSERT_EQ(tree.first_leaf() + tree.leaves(), c);
    }
  }
}

TEST(ClusterTree, LeafOfANodeHasIt) {
  for (const Index N : {1, 2, 3, 5, 31, 64, 65, 127, 997, 17742}) {
    for (int L = 0; L <= 12; ++L) {  // with more leaves than nodes too
      const ClusterTree tree{N, L};
      for (Index node = 0; node < N; ++node) {
        const Index leaf = tree.leaf_of(node);
        ASSERT_EQ(ClusterTree::level(leaf), L);
        ASSERT_LE(tree.begin(leaf), node) << N << ", " << L;
        ASSERT_GT(tree.end(leaf), node) << N << ", " << L;
      }
    }
  }
}

TEST(ClusterTree, LargestTreeDoesNotOverflow) {
  const ClusterTree tree{100'000'003, most_levels};
  EXPECT_EQ(tree.end(tree.clusters() - 1), tree.nodes);
  for (const Index node : {0, 1, 47, 48, 50'000'001, 99'999'999, 100'000'002}) {
    EXPECT_LE(tree.begin(tree.leaf_of(node)), node);
    EXPECT_GT(tree.end(tree.leaf_of(node)), node);
  }
}

TEST(Clusters, EveryPairOfNodesIsInOnePair) {
  for (const double eta : {0.7, 2.0, 5.0}) {
    expect_clusters(cloud(613, Vec3(1.0, 0.7, 0.4)), {.leaf = 16, .eta = eta});
    expect_clusters(cloud(512, Vec3(1.0, 0.1, 0.05)), {.leaf = 8, .eta = eta});
    expect_clusters(cloud(257, Vec3(0.02, 0.05, 0.0)), {.leaf = 4, .eta = eta});  // in the plane
    expect_clusters(cloud(100, Vec3(1.0, 0.0, 0.0)), {.leaf = 1, .eta = eta});
  }
}

TEST(Clusters, PointsOfAGrid) {
  expect_clusters(grid(9, 9, 7), {.leaf = 8});
  expect_clusters(grid(8, 8, 8, 0.1), {.leaf = 3});
  expect_clusters(grid(25, 20, 1, 0.1), {.leaf = 8});
}

TEST(Clusters, FewPoints) {
  expect_clusters(cloud(1, Vec3::Ones()), {});
  expect_clusters(cloud(1, Vec3::Ones()), {.leaf = 1});
  expect_clusters(cloud(2, Vec3::Ones()), {.leaf = 1});
  expect_clusters(cloud(3, Vec3::Ones()), {.leaf = 1});
  expect_clusters(cloud(64, Vec3::Ones()), {.leaf = 64});
  expect_clusters(cloud(65, Vec3::Ones()), {.leaf = 64});
  expect_clusters(cloud(131, Vec3::Ones()), {.leaf = 64});
  for (const Index prime : {7, 13, 127, 211}) expect_clusters(cloud(prime, Vec3::Ones()), {.leaf = 3});
}

// Nodes on both sides of a crack.
TEST(Clusters, CoincidentPointsAreNear) {
  std::vector<Vec3> points = cloud(40, Vec3::Ones());
  points.insert(points.end(), points.begin(), points.end());
  expect_clusters(points, {.leaf = 1});
  expect_clusters(std::vector<Vec3>(33, Vec3(0.1, 0.2, 0.3)), {.leaf = 4});
}

TEST(Clusters, NumbersDecideBetweenEqualCoordinates) {
  const ClusteredNodes nodes = cluster_nodes(std::vector<Vec3>(33, Vec3(0.1, 0.2, 0.3)), {.leaf = 4});
  EXPECT_TRUE(std::is_sorted(nodes.order.begin(), nodes.order.end()));
  // Of two columns of points with equal x the lower numbers of the second come first.
  std::vector<Vec3> points(8, Vec3(0.0, 0.0, 0.0));
  for (std::size_t k = 3; k < 8; ++k) points[k].x() = 1.0;
  EXPECT_EQ(cluster_nodes(points, {.leaf = 4}).order, (std::vector<Index>{0, 1, 2, 3, 4, 5, 6, 7}));
}

TEST(Clusters, LevelsGoByTheNumberOfNodes) {
  const auto levels = [](Index nodes, Index leaf) {
    return cluster_nodes(cloud(nodes, Vec3::Ones()), {.leaf = leaf}).tree.levels;
  };
  EXPECT_EQ(levels(1, 64), 0);
  EXPECT_EQ(levels(64, 64), 0);
  EXPECT_EQ(levels(66, 64), 1);
  EXPECT_EQ(levels(128, 64), 1);
  EXPECT_EQ(levels(130, 64), 2);
  EXPECT_EQ(levels(17742, 64), 9);
}

void expect_equal(const ClusteredNodes& a, const ClusteredNodes& b) {
  EXPECT_EQ(a.tree.levels, b.tree.levels);
  EXPECT_EQ(a.order, b.order);
  EXPECT_EQ(a.near_pair, b.near_pair);
  EXPECT_EQ(a.far_pair, b.far_pair);
}

TEST(Clusters, EqualPointsGiveEqualTrees) {
  for (const auto& points : {cloud(613, Vec3(1.0, 0.7, 0.4)), grid(9, 9, 7), grid(25, 20, 1, 0.1)})
    expect_equal(cluster_nodes(points, {.leaf = 8}), cluster_nodes(std::vector(points), {.leaf = 8}));
}

// On a row of equal steps many pairs are as far as far pairs must be, but for rounding.
TEST(Clusters, RoundingDecidesNothingOnARow) {
  for (const double eta : {1.0, 2.0}) {
    for (const double step : {0.1, 0.7, 1.0 / 3.0, 1e-3}) {
      for (const Index leaf : {1, 2}) {
        const ClusterOptions options{.leaf = leaf, .eta = eta};
        expect_equal(cluster_nodes(grid(61, 1, 1), options), cluster_nodes(grid(61, 1, 1, step), options));
      }
    }
  }
}

// The first cut is across the longest side: what is left of it comes first.
TEST(Clusters, AreHalvedAcrossTheirLongestSide) {
  for (int axis = 0; axis < 3; ++axis) {
    Vec3 size(0.3, 0.3, 0.3);
    size[axis] = 1.0;
    const std::vector<Vec3> points = cloud(201, size);
    const ClusteredNodes nodes = cluster_nodes(points, {.leaf = 101});
    ASSERT_EQ(nodes.tree.levels, 1);
    EXPECT_LE(box_of(nodes, points, 1).high[axis], box_of(nodes, points, 2).low[axis]);
  }
}

}  // namespace
}  // namespace palpate::cluster_pairs_test
