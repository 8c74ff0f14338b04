// Held nodes and their displacements.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "meshes/mesh.h"
#include "precompute/description/description.h"

namespace palpate {

struct FixedNodes {
  std::vector<std::uint8_t> axes;  ///< [N] bit `axis` is set if held along it
  std::vector<Vec3> displacement;  ///< [N] along the held axes [m]; zero along others
};

/// Combines all entries. Throws Error (where = `file` and the entry) for a selection without nodes, and if
/// two entries hold a node along the same axis at different displacements.
FixedNodes hold_nodes(const Mesh& mesh, const std::vector<Fixing>& fixed, const std::string& file);

}  // namespace palpate
