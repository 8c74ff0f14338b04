// Connected parts of a mesh.
#pragma once

#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// A point that belongs to a region.
struct RegionPoint {
  Vec3 x;
  Index region;
};

/// One point in each part of each region (elements connected through sides): the middle of its largest
/// element.
std::vector<RegionPoint> region_points(const Mesh& mesh);

/// Removes parts of less than 1 % of the largest one's elements, which hang on it by an edge or a corner at
/// most, and the nodes that only they have. Returns the number of removed elements.
Index remove_crumbs(Mesh& mesh);

}  // namespace palpate
