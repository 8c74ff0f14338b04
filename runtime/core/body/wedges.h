// Sharp edges of a surface, and how near its nodes lie to them.
#pragma once

#include <array>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

#include "base/vectors.h"

namespace palpate {

/// Wedge of the body at a sharp edge beside a node.
struct Wedge {
  double distance = std::numeric_limits<double>::infinity();  ///< [m]
  double angle = std::numbers::pi;                            ///< between its faces [rad], less than pi
};

/// Finds up to two sharp edges beside each node of a surface in space, nearest first, that are not parallel
/// and no further than `reach` [m]: edges at which the body is convex and the surface bends by more than
/// `crease` [rad]. They are those of the node's own face, as they are sought along the surface, from node to
/// node.
[[nodiscard]] std::vector<std::array<Wedge, 2>> wedges_beside(std::span<const Vec3> nodes,
                                                              std::span<const Index> triangles, double crease,
                                                              double reach);

}  // namespace palpate
