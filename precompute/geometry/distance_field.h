// Smooth shapes of a voxel body and of its labels.
#pragma once

#include <cstdint>
#include <vector>

#include "precompute/images/voxel_body.h"

namespace palpate {

/// Exact Euclidean distances between voxel centres, with sign: for voxels inside that to the nearest one
/// outside, for those outside minus that to the nearest one inside (Felzenszwalb and Huttenlocher, Distance
/// transforms of sampled functions, 2012). [voxels]
std::vector<float> signed_distances(const VoxelGrid& grid, const std::vector<std::uint8_t>& inside);

/// Distance below the boundary of what is inside, negative outside: signed_distances smoothed over
/// neighbouring voxels, linear between voxel centres.
class DistanceField {
 public:
  DistanceField(const VoxelGrid& grid, const std::vector<std::uint8_t>& inside);

  /// At a point in the image's length unit; beyond the grid, the value at its rim.
  [[nodiscard]] double operator()(const Vec3& x) const noexcept;

  /// Moves the boundary outward, by a voxel at most, until the volume inside is that of so many voxels.
  /// Nothing where that is so already.
  void grow_to(double voxels);

 private:
  VoxelGrid grid_;
  std::vector<float> distance_;
};

/// Which label of a body a point has: the body is where its DistanceField is positive, and there the label is
/// the one with the largest DistanceField of its own. A body without labels has label 0 everywhere.
class LabelField {
 public:
  struct Place {
    int number;    ///< 0 outside the body, else 1 + place of the label in labels()
    double depth;  ///< distance to where this label ends; 0 outside
  };

  explicit LabelField(const VoxelBody& body);

  /// Moves the boundary of the body outward until it holds the volume of so many voxels.
  void grow_to(double voxels) { body_.grow_to(voxels); }

  [[nodiscard]] Place operator()(const Vec3& x) const noexcept;
  /// Whether a point is in the body.
  [[nodiscard]] bool holds(const Vec3& x) const noexcept { return body_(x) > 0.0; }
  /// Those that occur, ascending.
  [[nodiscard]] const std::vector<Index>& labels() const noexcept { return labels_; }

 private:
  DistanceField body_;
  std::vector<Index> labels_;
  std::vector<DistanceField> parts_;  ///< [labels]; empty for a single one
};

}  // namespace palpate
