// A simplex of the surface and the place of a tool that is nearest to it.
#pragma once

#include "runtime/body/body.h"
#include "runtime/solve/nearest_point.h"
#include "runtime/solve/surface_tree.h"
#include "runtime/touch/tool_geometry.h"

namespace palpate {

/// Nearest points of a tool's core and a simplex.
struct TouchingPair {
  Index simplex = -1;
  int place = 0;  ///< on the core: 0 its origin, 1 its end, 2 anywhere; on a disc's rim 1 and 3 over an
                  ///< edge, from 4 on the eight
  NearestPoint nearest;
  Vec3 normal = Vec3::Zero();  ///< of the simplex, outward, unit
  double height = 0.0;         ///< of the core's point over the simplex's plane [m]
  double distance = 0.0;       ///< [m]
};

/// Nodes of a simplex, the third -1 in the plane.
using SimplexNodes = std::array<Index, 3>;
SimplexNodes nodes_of(const Body& body, Index simplex) noexcept;

/// Whether a tool is a sphere so large that it touches a simplex at its corners alone, as its edges and face
/// are chords of the smooth surface.
bool touches_corners_alone(const Body& body, const Tool& tool, Index simplex) noexcept;

/// The simplices whose box is within `reach` of the core's: as SurfaceTree::near_segment.
std::size_t near_core(const SurfaceTree& tree, const Core& core, double reach,
                      std::span<Index> found) noexcept;

/// Outward unit normal of a simplex where the tree has it; zero without area.
Vec3 outward_normal(const SurfaceTree& tree, const SimplexNodes& nodes) noexcept;

/// Nearest points of a tool's core and a simplex where the tree has it; of a core that is a point, by that.
NearestPoint nearest_points(const SurfaceTree& tree, const SimplexNodes& nodes, const Core& core,
                            bool is_point) noexcept;

/// The corner of a simplex that is nearest to the core's origin.
NearestPoint nearest_corner(const SurfaceTree& tree, const SimplexNodes& nodes, const Core& core) noexcept;

/// Sets the normal of a pair, and the height of the core's point over the simplex.
void find_height(const SurfaceTree& tree, const SimplexNodes& nodes, TouchingPair& pair) noexcept;

/// The pair of a simplex and an end of the core: 0 its origin, 1 its end.
TouchingPair pair_of_end(const Body& body, const SurfaceTree& tree, Index simplex, const Core& core,
                         int place) noexcept;

/// The pair of a simplex and the whole core.
TouchingPair pair_of_core(const Body& body, const SurfaceTree& tree, Index simplex,
                          const Core& core) noexcept;

/// The pair of a corner and the core, of the simplex of another pair, which has these nodes.
TouchingPair pair_of_corner(const SurfaceTree& tree, const SimplexNodes& nodes, const TouchingPair& seen,
                            std::size_t corner, const Core& core, int place) noexcept;

/// The pair of a triangle's edge, from a corner to the next one, and the core.
TouchingPair pair_of_edge(const SurfaceTree& tree, const SimplexNodes& nodes, const TouchingPair& seen,
                          std::size_t corner, const Core& core) noexcept;

/// The pairs of a disc's rim and where a triangle's edge, from a corner to the next one, passes over it along
/// the disc's axis: up to two. Returns how many.
std::size_t pairs_over_rim(const SurfaceTree& tree, const SimplexNodes& nodes, const TouchingPair& seen,
                           std::size_t corner, const Core& core, std::array<TouchingPair, 2>& pairs) noexcept;

/// The pair of a simplex and one of eight places around a disc's rim.
constexpr int places_on_rim = 8;
TouchingPair pair_on_rim(const Body& body, const SurfaceTree& tree, Index simplex, const Core& core,
                         int place) noexcept;

/// Whether the nearest point is within a triangle, at neither a corner nor an edge.
inline bool is_within_face(const TouchingPair& pair) noexcept {
  const std::array<double, 3>& weights = pair.nearest.weights;
  return weights[0] > 0.0 && weights[1] > 0.0 && weights[2] > 0.0;
}

/// A contact's axes as columns: the normal, and two tangents beside it; in the plane the first is within it.
[[nodiscard]] Eigen::Matrix3d contact_frame(const Vec3& normal, int dimension) noexcept;

}  // namespace palpate
