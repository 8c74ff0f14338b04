// Connected parts of a mesh.
#pragma once

#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// A point in a region.
struct RegionPoint {
  Vec3 x;
  Index region;
};

/// One point in each part of each region (elements connected through sides): the centre of its largest
/// element.
std::vector<RegionPoint> region_points(const Mesh& mesh);

/// Removes parts of less than 1 % of the largest one's elements, connected to it by an edge or a corner at
/// most, and their own nodes. Returns the number of removed elements.
Index remove_crumbs(Mesh& mesh);

}  // namespace palpate
