// Smooth surface through the nodes of a mesh of simplices.
#pragma once

#include <map>
#include <span>
#include <utility>

#include "meshes/mesh.h"

namespace palpate {

/// Quadratic facets through the corners of a surface, perpendicular at each to the mean normal of the facets
/// round it (Nagata, Simple local interpolation of surfaces using normal vectors, 2005, for arcs that do not
/// turn over). Edges at which the surface bends by more than `crease` stay straight, and end the facets that
/// a corner's normal is the mean of. Flat for elements that are not simplices, and at edges whose middle node
/// is off the middle.
class Rounding {
 public:
  static constexpr double crease = 40.0;  ///< [degrees]

  explicit Rounding(const Mesh& mesh);

  /// Offset [m] from the flat facet at a point by its weights of corners, which sum to 1.
  [[nodiscard]] Vec3 offset(std::span<const std::pair<Index, double>> weights) const;

 private:
  std::map<std::pair<Index, Index>, Vec3> bend_;  // c of edges: offset is -c w_a w_b
};

}  // namespace palpate
