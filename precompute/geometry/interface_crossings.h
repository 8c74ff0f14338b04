// Points on the interfaces between labels of a body.
#pragma once

#include <vector>

#include "precompute/geometry/distance_field.h"

namespace palpate {

/// Two points with different labels.
struct Crossing {
  Vec3 from, to;
};

/// Centres of neighbouring voxels of the body that have different labels in the image and in the field,
/// spread over the interfaces. Their distance is half the thickness of the thinner label there, at most
/// `largest_distance` and at least a voxel. The body needs an empty rim, as made by crop.
std::vector<Crossing> interface_crossings(const VoxelBody& body, const LabelField& field,
                                          double largest_distance);

}  // namespace palpate
