#include "runtime/core/touch/touching_pair.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "runtime/core/solve/nearest_on_disc.h"
#include "runtime/core/solve/tick_tuning.h"

namespace palpate {
namespace {

NearestPoint nearest_on_simplex(const SurfaceTree& tree, const SimplexNodes& nodes,
                                const Vec3& point) noexcept {
  const Vec3& a = tree.position(nodes[0]);
  const Vec3& b = tree.position(nodes[1]);
  return nodes[2] < 0 ? nearest_on_line(point, a, b)
                      : nearest_on_triangle(point, a, b, tree.position(nodes[2]));
}

Disc disc_of(const Core& core) noexcept {
  return {core.origin, core.axis, core.disc_radius};
}

NearestPoint nearest_to_edge(const Core& core, const Vec3& a, const Vec3& b) noexcept {
  return core.disc_radius > 0.0 ? nearest_of_disc_and_line(disc_of(core), a, b)
                                : nearest_of_segments(core.origin, core.end, a, b);
}

Vec3 nearest_on_core(const Core& core, const Vec3& point) noexcept {
  return core.disc_radius > 0.0 ? nearest_on_disc(disc_of(core), point)
                                : nearest_on_line(point, core.origin, core.end).on_simplex;
}

NearestPoint nearest_to_core(const SurfaceTree& tree, const SimplexNodes& nodes, const Core& core) noexcept {
  const Vec3& a = tree.position(nodes[0]);
  const Vec3& b = tree.position(nodes[1]);
  if (core.disc_radius > 0.0)
    return nearest_of_disc_and_triangle(disc_of(core), a, b, tree.position(nodes[2]));
  return nodes[2] < 0 ? nearest_of_segments(core.origin, core.end, a, b)
                      : nearest_of_segment_and_triangle(core.origin, core.end, a, b, tree.position(nodes[2]));
}

/// Pair of a simplex with this normal.
TouchingPair pair_of(Index simplex, const Vec3& normal, int place, const NearestPoint& nearest) noexcept {
  const Vec3 across = nearest.on_core - nearest.on_simplex;
  return {.simplex = simplex,
          .place = place,
          .nearest = nearest,
          .normal = normal,
          .height = across.dot(normal),
          .distance = across.norm()};
}

/// Pair of a simplex and the core with these nearest points.
TouchingPair make_pair(const SurfaceTree& tree, const SimplexNodes& nodes, Index simplex, int place,
                       const NearestPoint& nearest) noexcept {
  return pair_of(simplex, outward_normal(tree, nodes), place, nearest);
}

}  // namespace

SimplexNodes nodes_of(const ElasticBody& body, Index simplex) noexcept {
  const auto d = static_cast<std::size_t>(body.dimension());
  const std::size_t at = d * static_cast<std::size_t>(simplex);
  const std::span<const Index> simplices = body.simplices();
  return {simplices[at], simplices[at + 1], d == 3 ? simplices[at + 2] : -1};
}

bool touches_corners_alone(const ElasticBody& body, const Tool& tool, Index simplex) noexcept {
  return has_point_core(tool) && tool.radius > tuning.detection.smooth_radius * body.simplex_edges()[simplex];
}

std::size_t near_core(const SurfaceTree& tree, const Core& core, double reach,
                      std::span<Index> found) noexcept {
  if (core.disc_radius == 0.0) return tree.near_segment(core.origin, core.end, reach, found);
  const Vec3 half = core.disc_radius * (1.0 - core.axis.array().square()).max(0.0).sqrt().matrix();
  return tree.near_segment(core.origin - half, core.origin + half, reach, found);
}

Vec3 outward_normal(const SurfaceTree& tree, const SimplexNodes& nodes) noexcept {
  const Vec3& a = tree.position(nodes[0]);
  const Vec3& b = tree.position(nodes[1]);
  Vec3 normal;
  if (nodes[2] < 0) {
    normal = Vec3(b.y() - a.y(), a.x() - b.x(), 0.0);
  } else {
    normal = (b - a).cross(tree.position(nodes[2]) - a);
  }
  const double length = normal.norm();
  return length > 0.0 ? Vec3(normal / length) : Vec3::Zero();
}

NearestPoint nearest_points(const SurfaceTree& tree, const SimplexNodes& nodes, const Core& core,
                            bool is_point) noexcept {
  return is_point ? nearest_on_simplex(tree, nodes, core.origin) : nearest_to_core(tree, nodes, core);
}

NearestPoint nearest_corner(const SurfaceTree& tree, const SimplexNodes& nodes, const Core& core) noexcept {
  NearestPoint nearest;
  nearest.squared_distance = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3 && nodes[k] >= 0; ++k) {
    const double squared = (core.origin - tree.position(nodes[k])).squaredNorm();
    if (squared >= nearest.squared_distance) continue;
    nearest = {.on_simplex = tree.position(nodes[k]), .on_core = core.origin, .squared_distance = squared};
    nearest.weights[k] = 1.0;
  }
  return nearest;
}

void find_height(const SurfaceTree& tree, const SimplexNodes& nodes, TouchingPair& pair) noexcept {
  pair.normal = outward_normal(tree, nodes);
  pair.height = (pair.nearest.on_core - pair.nearest.on_simplex).dot(pair.normal);
}

TouchingPair pair_of_end(const ElasticBody& body, const SurfaceTree& tree, Index simplex, const Core& core,
                         int place) noexcept {
  const SimplexNodes nodes = nodes_of(body, simplex);
  const Vec3& end = place == 0 ? core.origin : core.end;
  NearestPoint nearest = nearest_on_simplex(tree, nodes, end);
  nearest.on_core = end;
  return make_pair(tree, nodes, simplex, place, nearest);
}

TouchingPair pair_of_core(const ElasticBody& body, const SurfaceTree& tree, Index simplex,
                          const Core& core) noexcept {
  const SimplexNodes nodes = nodes_of(body, simplex);
  return make_pair(tree, nodes, simplex, 2, nearest_to_core(tree, nodes, core));
}

TouchingPair pair_of_corner(const SurfaceTree& tree, const SimplexNodes& nodes, const TouchingPair& seen,
                            std::size_t corner, const Core& core, int place) noexcept {
  NearestPoint nearest;
  nearest.weights[corner] = 1.0;
  nearest.on_simplex = tree.position(nodes[corner]);
  nearest.on_core = place == 0 ? core.origin : nearest_on_core(core, nearest.on_simplex);
  nearest.squared_distance = (nearest.on_core - nearest.on_simplex).squaredNorm();
  return pair_of(seen.simplex, seen.normal, place, nearest);
}

TouchingPair pair_of_edge(const SurfaceTree& tree, const SimplexNodes& nodes, const TouchingPair& seen,
                          std::size_t corner, const Core& core) noexcept {
  const std::size_t next = (corner + 1) % 3;
  NearestPoint nearest = nearest_to_edge(core, tree.position(nodes[corner]), tree.position(nodes[next]));
  const std::array<double, 3> weights = nearest.weights;
  nearest.weights = {};
  nearest.weights[corner] = weights[0];
  nearest.weights[next] = weights[1];
  return pair_of(seen.simplex, seen.normal, 2, nearest);
}

std::size_t pairs_over_rim(const SurfaceTree& tree, const SimplexNodes& nodes, const TouchingPair& seen,
                           std::size_t corner, const Core& core,
                           std::array<TouchingPair, 2>& pairs) noexcept {
  // From the lower node, so that both triangles of an edge number a place in the same way.
  std::size_t from = corner;
  std::size_t to = (corner + 1) % 3;
  if (nodes[from] > nodes[to]) std::swap(from, to);
  const Vec3& a = tree.position(nodes[from]);
  const Vec3& b = tree.position(nodes[to]);
  const std::array<double, 2> shares = shares_over_rim(disc_of(core), a, b);
  std::size_t count = 0;
  for (std::size_t k = 0; k < 2; ++k) {
    const double share = shares[k];
    if (!(share > 0.0 && share < 1.0)) continue;
    NearestPoint nearest;
    nearest.weights[from] = 1.0 - share;
    nearest.weights[to] = share;
    nearest.on_simplex = (1.0 - share) * a + share * b;
    nearest.on_core = nearest_on_core(core, nearest.on_simplex);
    nearest.squared_distance = (nearest.on_core - nearest.on_simplex).squaredNorm();
    pairs[count++] = pair_of(seen.simplex, seen.normal, k == 0 ? 1 : 3, nearest);
  }
  return count;
}

TouchingPair pair_on_rim(const ElasticBody& body, const SurfaceTree& tree, Index simplex, const Core& core,
                         int place) noexcept {
  const double angle = 2.0 * std::numbers::pi * place / places_on_rim;
  const Vec3 outward = std::cos(angle) * core.diameter + std::sin(angle) * core.axis.cross(core.diameter);
  const SimplexNodes nodes = nodes_of(body, simplex);
  return make_pair(tree, nodes, simplex, 4 + place,
                   nearest_on_simplex(tree, nodes, core.origin + core.disc_radius * outward));
}

Eigen::Matrix3d contact_frame(const Vec3& normal, int dimension) noexcept {
  Eigen::Matrix3d frame;
  frame.col(0) = normal;
  if (dimension == 2) {
    frame.col(1) = Vec3(-normal.y(), normal.x(), 0.0);
  } else {
    frame.col(1) = normal.unitOrthogonal();
  }
  frame.col(2) = frame.col(0).cross(frame.col(1));
  return frame;
}

}  // namespace palpate
