#include "runtime/core/body/wedges.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <queue>
#include <tuple>
#include <utility>

#include "runtime/core/solve/nearest_point.h"

namespace palpate {
namespace {

constexpr double parallel = 0.7;  // cosine of the angle between edges, from which on the nearer one counts

/// Distances from sharp edges, spread over a surface from its edges' ends.
class Spreading {
 public:
  Spreading(std::span<const Vec3> nodes, std::span<const Index> triangles, double crease, double reach)
      : nodes_(nodes), reach_(reach), beside_(nodes.size()), found_(nodes.size()), edge_of_(nodes.size()) {
    find_edges(triangles, crease);
  }

  [[nodiscard]] std::vector<std::array<Wedge, 2>> run() {
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      for (const Index end : edges_[e].ends) next_.emplace(0.0, end, e);
    }
    while (!next_.empty()) {
      const auto [distance, node, edge] = next_.top();
      next_.pop();
      if (!take(distance, node, edge)) continue;
      for (const Index other : beside_[node]) {
        const double far = distance_to(edge, nodes_[other]);
        if (far < reach_) next_.emplace(far, other, edge);
      }
    }
    return std::move(found_);
  }

 private:
  struct Edge {
    std::array<Index, 2> ends;
    double angle;
  };
  /// A side of a triangle: its ends in order, and the triangle's third node.
  struct Side {
    std::array<Index, 2> ends;
    Index opposite;
    bool is_reversed;  // the triangle has its ends the other way round
  };

  void find_edges(std::span<const Index> triangles, double crease) {
    std::vector<Side> sides;
    for (std::size_t s = 0; s < triangles.size(); s += 3) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Index a = triangles[s + k], b = triangles[s + (k + 1) % 3];
        sides.push_back({{std::min(a, b), std::max(a, b)}, triangles[s + (k + 2) % 3], a > b});
      }
    }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
      return std::tie(a.ends, a.opposite) < std::tie(b.ends, b.opposite);
    });
    for (std::size_t s = 0; s < sides.size(); ++s) {
      const bool is_pair = s + 1 < sides.size() && sides[s].ends == sides[s + 1].ends;
      if (s == 0 || sides[s].ends != sides[s - 1].ends) {
        beside_[sides[s].ends[0]].push_back(sides[s].ends[1]);
        beside_[sides[s].ends[1]].push_back(sides[s].ends[0]);
      }
      if (is_pair) add_if_sharp(sides[s], sides[s + 1], crease);
    }
  }

  void add_if_sharp(const Side& a, const Side& b, double crease) {
    const Vec3& from = nodes_[a.ends[0]];
    const Vec3 along = (nodes_[a.ends[1]] - from).normalized();
    const auto into_face = [&](const Side& side) {
      const Vec3 x = nodes_[side.opposite] - from;
      return Vec3((x - x.dot(along) * along).normalized());
    };
    const Vec3 of_a = into_face(a), of_b = into_face(b);
    const bool is_convex = (along.cross(of_a).dot(of_b) < 0.0) != a.is_reversed;
    const double angle = std::acos(std::clamp(of_a.dot(of_b), -1.0, 1.0));
    if (is_convex && angle < std::numbers::pi - crease) edges_.push_back({a.ends, angle});
  }

  [[nodiscard]] double distance_to(std::size_t edge, const Vec3& x) const noexcept {
    const auto [a, b] = edges_[edge].ends;
    return std::sqrt(nearest_on_line(x, nodes_[a], nodes_[b]).squared_distance);
  }

  /// True if the edge is new to the node and not parallel to one that is nearer.
  [[nodiscard]] bool take(double distance, Index node, std::size_t edge) {
    std::array<Wedge, 2>& of_node = found_[node];
    std::array<std::size_t, 2>& taken = edge_of_[node];
    const auto direction = [&](std::size_t e) {
      return Vec3((nodes_[edges_[e].ends[1]] - nodes_[edges_[e].ends[0]]).normalized());
    };
    for (std::size_t k = 0; k < 2; ++k) {
      if (std::isinf(of_node[k].distance)) {
        of_node[k] = {distance, edges_[edge].angle};
        taken[k] = edge;
        return true;
      }
      if (std::abs(direction(taken[k]).dot(direction(edge))) > parallel) return false;
    }
    return false;
  }

  using Next = std::tuple<double, Index, std::size_t>;  // distance, node, edge

  std::span<const Vec3> nodes_;
  double reach_;
  std::vector<std::vector<Index>> beside_;
  std::vector<Edge> edges_;
  std::vector<std::array<Wedge, 2>> found_;
  std::vector<std::array<std::size_t, 2>> edge_of_;
  std::priority_queue<Next, std::vector<Next>, std::greater<>> next_;
};

}  // namespace

std::vector<std::array<Wedge, 2>> wedges_beside(std::span<const Vec3> nodes, std::span<const Index> triangles,
                                                double crease, double reach) {
  return Spreading(nodes, triangles, crease, reach).run();
}

}  // namespace palpate
