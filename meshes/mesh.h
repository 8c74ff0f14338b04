// Mesh of a body: nodes, elements and the tags from its mesh file.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/vectors.h"
#include "meshes/element_type.h"

namespace palpate {

using Triangle = std::array<Index, 3>;  ///< node numbers, counter-clockwise seen from outside the body

/// Mesh of elements of one kind, coordinates in metres. A plane mesh (tri3, quad4) lies in z = 0.
struct Mesh {
  ElementType element = ElementType::tet4;
  std::vector<Vec3> nodes;          ///< [N] positions [m]
  std::vector<Index> connectivity;  ///< [E * nodes per element] node numbers, positively oriented
  std::vector<Index> regions;       ///< [E] region tag of each element; 0 where the source has none

  /// Boundary facets with a tag in the mesh file (Gmsh physical group, Medit reference, TetGen marker),
  /// possibly none: [T * nodes per facet] node numbers in any sense, and [T] tags.
  std::vector<Index> tagged_facets{};
  std::vector<Index> facet_tags{};

  /// Dimension of the space that the body moves in, 2 or 3; also the number of dofs per node.
  [[nodiscard]] int dimension() const noexcept { return traits(element).dimension; }
  [[nodiscard]] Index elements() const noexcept {
    return static_cast<Index>(connectivity.size() / static_cast<std::size_t>(traits(element).nodes));
  }
  /// Node numbers of element e.
  [[nodiscard]] std::span<const Index> element_nodes(Index e) const noexcept {
    const auto width = static_cast<std::size_t>(traits(element).nodes);
    return {connectivity.data() + width * static_cast<std::size_t>(e), width};
  }
  /// Node numbers of tagged facet t.
  [[nodiscard]] std::span<const Index> tagged_facet(Index t) const noexcept {
    const auto width = static_cast<std::size_t>(traits(traits(element).facet).nodes);
    return {tagged_facets.data() + width * static_cast<std::size_t>(t), width};
  }
};

}  // namespace palpate
