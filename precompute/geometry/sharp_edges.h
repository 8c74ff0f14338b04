// Edges of boxes in a voxel body.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "precompute/images/voxel_body.h"

namespace palpate {

/// Straight edges of voxels such as those of a box or of a step in it, in place of which the smooth shape of
/// a body (DistanceField) is round. Each is three voxels long at least, and all edges of voxels that are
/// nearer to it than that are among them: steps of voxels along a slope and the rims of cut organs have none.
struct SharpEdges {
  enum : std::uint8_t { by_field, outside, inside };

  std::vector<std::array<Vec3, 2>> edges;  ///< ends, in the image's length unit
  std::vector<std::uint8_t> known;         ///< [voxels] beside an edge outside or inside the body, elsewhere
                                           ///< by_field; empty if there is no edge
};

/// Needs an empty rim, as made by crop.
SharpEdges sharp_edges(const VoxelBody& body);

}  // namespace palpate
