// What a tool looks like.
#pragma once

#include <vector>

#include "runtime/touch/tool.h"

namespace palpate {

/// Triangles, counter-clockwise seen from outside.
struct ToolMesh {
  std::vector<Vec3> positions;   ///< [V] from the tool's origin, not turned [m]
  std::vector<Vec3> normals;     ///< [V] outward
  std::vector<Index> triangles;  ///< [T x 3]
};

/// A sphere, capsule or disc with a round edge, turned out of rings of latitude; a point as a sphere of
/// radius `point` [m].
[[nodiscard]] ToolMesh tool_mesh(const Tool& tool, double point);

}  // namespace palpate
