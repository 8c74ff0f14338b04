// An order of nodes in which neighbours follow each other.
#pragma once

#include <span>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// All nodes in the order in which a Hilbert curve through their bounding cube meets them: each is near the
/// one before it, in space or in the plane. Nodes at one place stay in their own order.
std::vector<Index> order_along_curve(std::span<const Vec3> nodes);

}  // namespace palpate
