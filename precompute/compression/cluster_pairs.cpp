#include "precompute/compression/cluster_pairs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>

namespace palpate {
namespace {

using Box = Eigen::AlignedBox3d;
using Pair = HierarchicalMatrix::Pair;

class Clustering {
 public:
  Clustering(std::span<const Vec3> points, const ClusterOptions& options)
      : points_(points), options_(options) {
    result_.tree.nodes = static_cast<Index>(points.size());
    while ((result_.tree.nodes >> result_.tree.levels) > options.leaf && result_.tree.levels < most_levels)
      ++result_.tree.levels;
    result_.order.resize(points.size());
    std::iota(result_.order.begin(), result_.order.end(), 0);
    boxes_.resize(static_cast<std::size_t>(result_.tree.clusters()));
  }

  ClusteredNodes run() {
    split(0);
    compare(0, 0);
    const auto by_column = [](const Pair& a, const Pair& b) {
      return std::pair(a[1], a[0]) < std::pair(b[1], b[0]);
    };
    std::sort(result_.near_pair.begin(), result_.near_pair.end(), by_column);
    std::sort(result_.far_pair.begin(), result_.far_pair.end(), by_column);
    return std::move(result_);
  }

 private:
  [[nodiscard]] bool is_leaf(Index c) const { return c >= result_.tree.first_leaf(); }

  void split(Index c) {
    const auto begin = result_.order.begin() + result_.tree.begin(c),
               end = result_.order.begin() + result_.tree.end(c);
    Box& box = boxes_[static_cast<std::size_t>(c)];
    std::for_each(begin, end, [&](Index k) { box.extend(points_[static_cast<std::size_t>(k)]); });
    if (is_leaf(c)) {
      std::sort(begin, end);
      return;
    }
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    const auto before = [&](Index a, Index b) {
      const double xa = points_[static_cast<std::size_t>(a)][axis],
                   xb = points_[static_cast<std::size_t>(b)][axis];
      return xa < xb || (xa == xb && a < b);
    };
    std::nth_element(begin, result_.order.begin() + result_.tree.begin(2 * c + 2), end, before);
    split(2 * c + 1);
    split(2 * c + 2);
  }

  /// True if two clusters are far. If both sides are equal up to rounding, as on a grid, rounding must not
  /// decide: machines differ in it.
  [[nodiscard]] bool far(Index a, Index b) const {
    const Box &A = boxes_[static_cast<std::size_t>(a)], &B = boxes_[static_cast<std::size_t>(b)];
    const double diameter = std::max(A.diagonal().norm(), B.diagonal().norm());
    const double distance = A.exteriorDistance(B);
    return distance > 0.0 && diameter <= (1.0 + 1e-9) * options_.eta * distance;
  }

  /// Adds the pairs of clusters a >= b.
  void compare(Index a, Index b) {
    if (a != b && far(a, b)) {
      result_.far_pair.push_back({a, b});
    } else if (is_leaf(a)) {
      result_.near_pair.push_back({a, b});
    } else {
      compare(2 * a + 1, 2 * b + 1);
      compare(2 * a + 2, 2 * b + 1);
      if (a != b) compare(2 * a + 1, 2 * b + 2);
      compare(2 * a + 2, 2 * b + 2);
    }
  }

  std::span<const Vec3> points_;
  ClusterOptions options_;
  ClusteredNodes result_;
  std::vector<Box> boxes_;
};

}  // namespace

ClusteredNodes cluster_nodes(std::span<const Vec3> points, const ClusterOptions& options) {
  return Clustering(points, options).run();
}

}  // namespace palpate
