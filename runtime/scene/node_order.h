// Order of nodes in which neighbours follow each other.
#pragma once

#include <span>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Returns all nodes in the order of a Hilbert curve through their bounding cube, in space or in the plane:
/// each is near the previous one. Coincident nodes keep their own order.
std::vector<Index> order_along_curve(std::span<const Vec3> nodes);

}  // namespace palpate
