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

/// Which voxels are body, and of which label.
struct VoxelBody : VoxelGrid {
  static constexpr Index no_label = std::numeric_limits<Index>::min();

  double file_unit = 0.0;             ///< that the image's file counts in [mm]; 0: it does not say
  Mat3 shear = Mat3::Identity();      ///< of an image whose axes are not at right angles: grid to space
  Vec3 sheared_about = Vec3::Zero();  ///< the point of the grid that stays where it is
  /// Place in space of a point x of the grid: x itself unless the image is sheared.
  [[nodiscard]] Vec3 in_space(const Vec3& x) const { return sheared_about + shear * (x - sheared_about); }

  std::vector<std::uint8_t> inside;  ///< [voxels] 1 where body
  std::vector<Index> labels;  ///< [voxels] of the body, no_label elsewhere; empty: labels do not matter
};

/// The voxels copied to the smallest grid that holds them and `margin` empty voxels on every side. Needs one
/// voxel of body.
VoxelBody crop(const VoxelBody& body, Index margin);

/// Voxels that are marked by 1, in parts (connected through faces) of at least so many.
std::size_t voxels_of_parts(const VoxelGrid& grid, const std::vector<std::uint8_t>& marks, std::size_t least);

/// Keeps the largest part (voxels connected through faces): removes parts smaller than 1 % of it and fills
/// cavities smaller than that, each told in `notes`. Throws Error (where = `where`) when another large part
/// is left. Needs an empty rim, as crop leaves it.
void keep_one_part(VoxelBody& body, const std::string& where, std::vector<std::string>& notes);

/// Fills a voxel wherever two touch along an edge only: there, no surface separates body from not-body.
/// Returns how many. Needs an empty rim.
std::size_t join_across_edges(VoxelBody& body);

/// Gives every voxel of the body a label, after its voxels have changed: parts of a label of fewer than
/// `smallest` voxels, told in `notes`, and filled voxels take the label of what is around them. Needs a
/// labelled body in one part.
void complete_labels(VoxelBody& body, std::size_t smallest, std::vector<std::string>& notes);

}  // namespace palpate
