// Where the labels of a body meet.
#pragma once

#include <vector>

#include "precompute/geometry/distance_field.h"

namespace palpate {

/// Two points with different labels.
struct Crossing {
  Vec3 from, to;
};

/// Centres of neighbouring voxels of the body that have different labels in the image and in the field,
/// spread over the interfaces: from each other they are as far as the thinner of the two labels is half thick
/// there, at most `largest_distance` and at least a voxel. The body needs an empty rim, as crop leaves it.
std::vector<Crossing> interface_crossings(const VoxelBody& body, const LabelField& field,
                                          double largest_distance);

}  // namespace palpate
