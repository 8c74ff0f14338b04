// Triangle mesh of a tool.
#pragma once

#include <vector>

#include "runtime/core/touch/tool.h"

namespace palpate {

/// Triangle mesh, counter-clockwise seen from outside.
struct ToolMesh {
  std::vector<Vec3> positions;   ///< [V] in the tool's frame [m]
  std::vector<Vec3> normals;     ///< [V] outward
  std::vector<Index> triangles;  ///< [T x 3]
};

/// Returns the mesh of a sphere, capsule or disc with a round edge, made of rings of latitude; a point
/// becomes a sphere of radius `point` [m].
[[nodiscard]] ToolMesh tool_mesh(const Tool& tool, double point);

}  // namespace palpate
