// The same block in every kind of element, for the tests of meshes/.
#pragma once

#include "meshes/generate.h"

namespace palpate::test {

/// [0, 0.4] x [0, 0.2] x [0, 0.2] m of 4 x 2 x 2 cells; in the plane [0, 0.4] x [0, 0.2] of 4 x 2.
inline Mesh block(ElementType type) {
  if (traits(type).dimension == 2) return generate(RectangleShape{Vec3::Zero(), {0.4, 0.2, 0}, {4, 2}}, type);
  const BoxShape box{Vec3::Zero(), Vec3(0.4, 0.2, 0.2), {4, 2, 2}};
  if (type == ElementType::tet10) return with_elements(generate(box), type, "");
  return generate(box, type);
}

inline double block_volume(ElementType type) {
  return traits(type).dimension == 2 ? 0.4 * 0.2 : 0.4 * 0.2 * 0.2;
}

inline const Vec3& node_of(const Mesh& mesh, Index node) {
  return mesh.nodes[static_cast<std::size_t>(node)];
}

}  // namespace palpate::test
