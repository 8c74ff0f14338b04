// Where the regions of a mesh are.
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

}  // namespace palpate
