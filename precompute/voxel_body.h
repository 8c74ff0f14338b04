// A body as voxels of an image.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Which voxels of a regular grid are body; voxel (i, j, k) has its centre at origin + (i, j, k) * spacing, x
/// fastest.
struct VoxelBody {
  std::array<Index, 3> size{};
  Vec3 spacing = Vec3::Ones();  ///< length units of the image
  Vec3 origin = Vec3::Zero();
  std::vector<std::uint8_t> inside;  ///< 1 where body

  [[nodiscard]] std::size_t at(Index i, Index j, Index k) const noexcept {
    const auto x = static_cast<std::size_t>(i), y = static_cast<std::size_t>(j),
               z = static_cast<std::size_t>(k);
    return x + static_cast<std::size_t>(size[0]) * (y + static_cast<std::size_t>(size[1]) * z);
  }
};

/// The same voxels on the smallest grid that holds them and `margin` empty voxels on every side. Needs one
/// voxel of body.
VoxelBody crop(const VoxelBody& body, Index margin);

/// Keeps the largest part (voxels connected through faces): removes parts smaller than 1 % of it and fills
/// cavities smaller than that, each told in `notes`. Throws Error (where = `where`) when another large part
/// is left. Needs an empty rim, as crop leaves it.
void keep_one_part(VoxelBody& body, const std::string& where, std::vector<std::string>& notes);

/// Fills a voxel wherever two touch along an edge only: there, no surface separates body from not-body.
/// Returns how many. Needs an empty rim.
std::size_t join_across_edges(VoxelBody& body);

/// Exact Euclidean distances between voxel centres, with sign: for voxels of body that to the nearest empty
/// one, for empty ones minus that to the nearest voxel of body (Felzenszwalb and Huttenlocher, Distance
/// transforms of sampled functions, 2012).
std::vector<float> signed_distances(const VoxelBody& body);

/// Distance below the body's boundary, negative outside: signed_distances smoothed over neighbouring voxels,
/// linear between voxel centres.
class DistanceField {
 public:
  explicit DistanceField(const VoxelBody& body);

  /// At a point in the image's length unit; beyond the grid, the value at its rim.
  [[nodiscard]] double operator()(const Vec3& x) const noexcept;

 private:
  VoxelBody grid_;
  std::vector<float> distance_;
};

}  // namespace palpate
