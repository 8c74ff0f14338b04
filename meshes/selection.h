// Geometric selections of nodes and elements.
#pragma once

#include <variant>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Nodes with min <= x <= max in each coordinate [m].
struct SelectBox {
  Vec3 min, max;
};
/// Nodes with (x - point) . normal >= 0.
struct SelectHalfSpace {
  Vec3 point, normal;
};
/// Nodes within `radius` of `center` [m].
struct SelectSphere {
  Vec3 center;
  double radius;
};
/// Nodes by number.
struct SelectNodes {
  std::vector<Index> nodes;
};
/// Nodes of the boundary facets with this tag.
struct SelectTag {
  Index tag;
};
/// Nodes in the lowest `fraction` (0..1) of the body's extent along an axis (0, 1, 2 for x, y, z).
struct SelectLowest {
  int axis;
  double fraction;
};

using Selection =
    std::variant<SelectBox, SelectHalfSpace, SelectSphere, SelectNodes, SelectTag, SelectLowest>;

/// Marks the selected nodes [N] (1 = selected). Distances have a tolerance of 1e-9 of the body's size. Throws
/// Error (where = `where`) if nothing is selected, a node number is out of range or a tag is unknown (the
/// message lists the tags there are).
std::vector<std::uint8_t> select_nodes(const Mesh& mesh, const Selection& selection,
                                       const std::string& where);

/// Marks the elements whose centroid (of the corners) is in the selection [E]. For boxes, half spaces,
/// spheres and lowest parts; throws Error for lists of nodes and for tags, and if nothing is selected.
std::vector<std::uint8_t> select_elements(const Mesh& mesh, const Selection& selection,
                                          const std::string& where);

}  // namespace palpate
