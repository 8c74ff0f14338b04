// Labelled images from files.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "precompute/description/description.h"
#include "precompute/images/voxel_body.h"

namespace palpate {

/// Reads an image, selects the labels that are body and makes them meshable: one part, with an empty rim,
/// nowhere connected by an edge alone. With `image.regions` every voxel keeps its label, except that specks
/// of less than 8 voxels or smaller than a regular tetrahedron of `edge_length` (in the image's unit) take
/// that of their surroundings. Changes are reported in `notes`. Throws Error for a file that is not an image,
/// labels that it does not have, and a body of several large parts.
VoxelBody read_labelled_image(const ImageGeometry& image, double edge_length,
                              std::vector<std::string>& notes);

}  // namespace palpate
