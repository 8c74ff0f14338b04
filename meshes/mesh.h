// What a body is before physics: nodes, elements and the tags that the mesh file gave them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace palpate {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Index =
    std::int32_t;  ///< node, element and facet numbers; counts of bytes and matrix entries are std::int64_t

using Tet = std::array<Index, 4>;       ///< node numbers, positively oriented: det[x1-x0, x2-x0, x3-x0] > 0
using Triangle = std::array<Index, 3>;  ///< node numbers, counter-clockwise seen from outside the body

/// Boundary facet that carries a tag in its mesh file (Gmsh physical surface, Medit reference, TetGen
/// marker).
struct TaggedTriangle {
  Triangle nodes;
  Index tag;
};

/// Tetrahedral volume mesh, coordinates in metres.
struct Mesh {
  std::vector<Vec3> nodes;     ///< [N] positions [m]
  std::vector<Tet> tets;       ///< [E] linear tetrahedra (tet4)
  std::vector<Index> regions;  ///< [E] region tag of each element; 0 where the source has none
  std::vector<TaggedTriangle> tagged_boundary{};  ///< facets with a boundary tag, possibly none
};

}  // namespace palpate
