// Smooth shapes of a voxel body and its labels.
#pragma once

#include <cstdint>
#include <vector>

#include "precompute/geometry/sharp_edges.h"
#include "precompute/images/voxel_body.h"

namespace palpate {

/// Exact signed Euclidean distances between voxel centres: for voxels inside to the nearest one outside, for
/// those outside minus the distance to the nearest one inside (Felzenszwalb and Huttenlocher, Distance
/// transforms of sampled functions, 2012). [voxels]
std::vector<float> signed_distances(const VoxelGrid& grid, const std::vector<std::uint8_t>& inside);

/// Distance below the boundary of the inside, negative outside: signed_distances smoothed over neighbouring
/// voxels, linear between voxel centres; beside sharp edges the distance to the faces of the voxels.
class DistanceField {
 public:
  /// `known`: SharpEdges::known of the same inside.
  DistanceField(const VoxelGrid& grid, const std::vector<std::uint8_t>& inside,
                std::vector<std::uint8_t> known = {});

  /// Value at a point in the image's length unit; beyond the grid the value at its rim.
  [[nodiscard]] double operator()(const Vec3& x) const noexcept;

  /// Moves the boundary outward, by a voxel at most, until the volume inside is that of so many voxels. Does
  /// nothing if it is at least that. Faces beside sharp edges stay.
  void grow_to(double voxels);

 private:
  struct Eighth;
  void add_eighths(std::size_t voxel, double least_width, std::vector<Eighth>& to) const;
  [[nodiscard]] double to_faces(const Vec3& x, const std::array<Index, 3>& voxel,
                                double smooth) const noexcept;

  VoxelGrid grid_;
  std::vector<float> distance_;
  std::vector<std::uint8_t> known_;
};

/// Label of a body at a point: the body is where its DistanceField is positive, and there the label is the
/// one whose own DistanceField is largest. A body without labels has label 0 everywhere.
class LabelField {
 public:
  struct Place {
    int number;    ///< 0 outside the body, else 1 + position of the label in labels()
    double depth;  ///< distance to the end of this label; 0 outside
  };

  explicit LabelField(const VoxelBody& body, const SharpEdges& sharp = {});

  /// Moves the boundary of the body outward until it holds the volume of so many voxels.
  void grow_to(double voxels) { body_.grow_to(voxels); }

  [[nodiscard]] Place operator()(const Vec3& x) const noexcept;
  /// True if a point is in the body.
  [[nodiscard]] bool holds(const Vec3& x) const noexcept { return body_(x) > 0.0; }
  /// Labels that occur, ascending.
  [[nodiscard]] const std::vector<Index>& labels() const noexcept { return labels_; }

 private:
  DistanceField body_;
  std::vector<Index> labels_;
  std::vector<DistanceField> parts_;  ///< [labels]; empty for a single one
};

}  // namespace palpate
