// A body as voxels of an image.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Regular grid; voxel (i, j, k) has its centre at origin + (i, j, k) * spacing, x fastest. Lengths are in
/// the image's unit.
struct VoxelGrid {
  std::array<Index, 3> size{};
  Vec3 spacing = Vec3::Ones();
  Vec3 origin = Vec3::Zero();

  [[nodiscard]] std::size_t at(Index i, Index j, Index k) const noexcept {
    const auto x = static_cast<std::size_t>(i), y = static_cast<std::size_t>(j),
               z = static_cast<std::size_t>(k);
    return x + static_cast<std::size_t>(size[0]) * (y + static_cast<std::size_t>(size[1]) * z);
  }
  [[nodiscard]] std::size_t voxels() const noexcept { return at(0, 0, size[2]); }
  [[nodiscard]] Vec3 center(std::size_t voxel) const noexcept;
};

/// Voxels that are body, with their labels.
struct VoxelBody : VoxelGrid {
  static constexpr Index no_label = std::numeric_limits<Index>::min();

  double file_unit = 0.0;             ///< unit of the image file's lengths [mm]; 0: not given
  Mat3 shear = Mat3::Identity();      ///< from the grid to space, for an image whose axes are not at right
                                      ///< angles
  Vec3 sheared_about = Vec3::Zero();  ///< point of the grid that the shear leaves in place
  /// Position in space of a point x of the grid: x itself unless the image is sheared.
  [[nodiscard]] Vec3 in_space(const Vec3& x) const { return sheared_about + shear * (x - sheared_about); }

  std::vector<std::uint8_t> inside;  ///< [voxels] 1 for body
  std::vector<Index> labels;  ///< [voxels] of the body, no_label elsewhere; empty: labels do not matter
};

/// The voxels in the smallest grid that contains them and `margin` empty voxels on every side. Requires at
/// least one voxel of body.
VoxelBody crop(const VoxelBody& body, Index margin);

/// Number of voxels marked by 1 in parts (connected through faces) of at least `least` voxels.
std::size_t voxels_of_parts(const VoxelGrid& grid, const std::vector<std::uint8_t>& marks, std::size_t least);

/// Keeps the largest part (voxels connected through faces): removes parts smaller than 1 % of it and fills
/// cavities smaller than that, each reported in `notes`. Throws Error (where = `where`) if another large part
/// remains. Needs an empty rim, as made by crop.
void keep_one_part(VoxelBody& body, const std::string& where, std::vector<std::string>& notes);

/// Fills a voxel wherever two touch along an edge only, where no surface separates body and background.
/// Returns the number of filled voxels. Needs an empty rim.
std::size_t join_across_edges(VoxelBody& body);

/// Gives every voxel of the body a label, after its voxels have changed: parts of a label of fewer than
/// `smallest` voxels, reported in `notes`, and filled voxels take the label of their surroundings. Needs a
/// labelled body in one part.
void complete_labels(VoxelBody& body, std::size_t smallest, std::vector<std::string>& notes);

}  // namespace palpate
