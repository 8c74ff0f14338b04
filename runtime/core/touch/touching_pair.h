// Pairs of a surface simplex and the nearest place of a tool.
#pragma once

#include "runtime/core/body/elastic_body.h"
#include "runtime/core/solve/nearest_point.h"
#include "runtime/core/solve/surface_tree.h"
#include "runtime/core/touch/tool_geometry.h"

namespace palpate {

/// Nearest points of a tool's core and a simplex.
struct TouchingPair {
  Index simplex = -1;
  int place = 0;  ///< place on the core: 0 its origin, 1 its end, 2 elsewhere; on a disc's rim 1 and 3 above
                  ///< an edge, 4 to 11 the eight places
  NearestPoint nearest;
  Vec3 normal = Vec3::Zero();  ///< outward normal of the simplex, unit vector
  double height = 0.0;         ///< height of the core's point above the simplex's plane [m]
  double distance = 0.0;       ///< [m]
};

/// Nodes of a simplex; the third is -1 in the plane.
using SimplexNodes = std::array<Index, 3>;
SimplexNodes nodes_of(const ElasticBody& body, Index simplex) noexcept;

/// True if a sphere is so large that it should touch a simplex at its corners only, since edges and face are
/// chords of the smooth surface.
bool touches_corners_alone(const ElasticBody& body, const Tool& tool, Index simplex) noexcept;

/// Finds the simplices whose bounding box is within `reach` of the core's, as SurfaceTree::near_segment does.
std::size_t near_core(const SurfaceTree& tree, const Core& core, double reach,
                      std::span<Index> found) noexcept;

/// Outward unit normal of a simplex in the tree; zero if it has no area.
Vec3 outward_normal(const SurfaceTree& tree, const SimplexNodes& nodes) noexcept;

/// Nearest points of a tool's core and a simplex in the tree. `is_point`: the core is a single point.
NearestPoint nearest_points(const SurfaceTree& tree, const SimplexNodes& nodes, const Core& core,
                            bool is_point) noexcept;

/// Corner of a simplex that is nearest to the core's origin.
NearestPoint nearest_corner(const SurfaceTree& tree, const SimplexNodes& nodes, const Core& core) noexcept;

/// Sets the normal of a pair, and the height of the core's point above the simplex.
void find_height(const SurfaceTree& tree, const SimplexNodes& nodes, TouchingPair& pair) noexcept;

/// Pair of a simplex and an end of the core: 0 its origin, 1 its end.
TouchingPair pair_of_end(const ElasticBody& body, const SurfaceTree& tree, Index simplex, const Core& core,
                         int place) noexcept;

/// Pair of a simplex and the whole core.
TouchingPair pair_of_core(const ElasticBody& body, const SurfaceTree& tree, Index simplex,
                          const Core& core) noexcept;

/// Pair of a corner and the core, for the simplex of the pair `seen`, which has these nodes.
TouchingPair pair_of_corner(const SurfaceTree& tree, const SimplexNodes& nodes, const TouchingPair& seen,
                            std::size_t corner, const Core& core, int place) noexcept;

/// Pair of a triangle's edge, from a corner to the next one, and the core.
TouchingPair pair_of_edge(const SurfaceTree& tree, const SimplexNodes& nodes, const TouchingPair& seen,
                          std::size_t corner, const Core& core) noexcept;

/// Finds the pairs of a disc's rim and the points where a triangle's edge, from a corner to the next one,
/// crosses it along the disc's axis: up to two. Returns their number.
std::size_t pairs_over_rim(const SurfaceTree& tree, const SimplexNodes& nodes, const TouchingPair& seen,
                           std::size_t corner, const Core& core, std::array<TouchingPair, 2>& pairs) noexcept;

/// Pair of a simplex and one of the eight places around a disc's rim.
constexpr int places_on_rim = 8;
TouchingPair pair_on_rim(const ElasticBody& body, const SurfaceTree& tree, Index simplex, const Core& core,
                         int place) noexcept;

/// True if the nearest point is inside a triangle, at neither a corner nor an edge.
inline bool is_within_face(const TouchingPair& pair) noexcept {
  const std::array<double, 3>& weights = pair.nearest.weights;
  return weights[0] > 0.0 && weights[1] > 0.0 && weights[2] > 0.0;
}

/// Returns a contact's axes as columns: the normal and two tangents; in the plane the first tangent lies in
/// it.
[[nodiscard]] Eigen::Matrix3d contact_frame(const Vec3& normal, int dimension) noexcept;

}  // namespace palpate
