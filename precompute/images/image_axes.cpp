#include "precompute/images/image_axes.h"

#include <fmt/format.h>
#include <nifti2_io.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "precompute/images/unpacked_file.h"

namespace palpate {
namespace {

/// Axis of the image along each axis of space, and whether it is reversed.
struct Axes {
  std::array<std::size_t, 3> from{};
  std::array<bool, 3> backwards{};
};

Axes axes_of(const Eigen::Matrix<double, 3, 4>& to_space) {
  nifti_dmat44 matrix{};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) matrix.m[row][column] = to_space(row, column);
  matrix.m[3][3] = 1.0;
  std::array<int, 3> codes{};
  nifti_dmat44_to_orientation(matrix, &codes[0], &codes[1], &codes[2]);
  Axes axes{{0, 1, 2}, {}};
  if (std::ranges::find(codes, 0) != codes.end()) return axes;  // a singular matrix
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto along = static_cast<std::size_t>((codes.at(axis) - NIFTI_L2R) / 2);
    axes.from.at(along) = axis;
    axes.backwards.at(along) = (codes.at(axis) - NIFTI_L2R) % 2 == 1;
  }
  return axes;
}

double degrees(double cosine) {
  return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi;
}

/// Axes at right angles in place of those of the image, by Gram and Schmidt: axes with longer steps are
/// rotated relative to the finer ones. Volumes are preserved.
Eigen::Matrix3d straightened(const Eigen::Matrix3d& columns) {
  std::array<int, 3> order = {0, 1, 2};
  std::ranges::stable_sort(order, {}, [&](int axis) { return columns.col(axis).norm(); });
  Eigen::Matrix3d straight = columns;
  for (std::size_t b = 0; b < 3; ++b) {
    for (std::size_t a = 0; a < b; ++a) {
      const Eigen::Vector3d along = straight.col(order.at(a));
      straight.col(order.at(b)) -= along.dot(straight.col(order.at(b))) / along.squaredNorm() * along;
    }
  }
  return straight;
}

/// Largest deviation of two axes from a right angle [degrees].
double skew(const Eigen::Matrix3d& columns) {
  double most = 0.0;
  for (int a = 0; a < 3; ++a) {
    const Eigen::Vector3d one = columns.col(a).normalized(), next = columns.col((a + 1) % 3).normalized();
    const double angle = std::abs(90.0 - degrees(one.dot(next)));
    if (!(angle <= most)) most = angle;  // a number or not
  }
  return most;
}

}  // namespace

ChildResult along_space(ImagePlace place, std::array<std::size_t, 3> size, Labels labels) {
  constexpr double least_skew = 0.1;  // degrees
  const Eigen::Matrix3d given = place.to_space.leftCols<3>();
  Eigen::Matrix3d directions = given;
  const bool is_sheared = !(skew(given) <= least_skew);
  if (is_sheared) place.to_space.leftCols<3>() = directions = straightened(given);
  const Axes axes = axes_of(place.to_space);
  const double unit = place.unit > 0.0 ? place.unit : 1.0;
  Eigen::Vector3d corner = place.to_space.col(3);
  const std::array<std::size_t, 3> stride = {1, size[0], size[0] * size[1]};
  ImageHeader header;
  header.unit = place.unit;
  std::array<std::ptrdiff_t, 3> step{};
  std::ptrdiff_t first = 0;
  Eigen::Matrix3d turn;  // from the axes of the body to space
  for (std::size_t along = 0; along < 3; ++along) {
    const std::size_t from = axes.from.at(along);
    const auto column = directions.col(static_cast<Eigen::Index>(from));
    const auto count = static_cast<std::ptrdiff_t>(size.at(from)),
               pace = static_cast<std::ptrdiff_t>(stride.at(from));
    header.size.at(along) = static_cast<Index>(count);
    header.spacing.at(along) = unit * column.norm();
    const double cosine = std::abs(column[static_cast<Eigen::Index>(along)]) / column.norm();
    header.turned = std::max(header.turned, degrees(cosine));
    const bool backwards = axes.backwards.at(along);
    turn.col(static_cast<Eigen::Index>(along)) = column.normalized() * (backwards ? -1.0 : 1.0);
    step.at(along) = backwards ? -pace : pace;
    if (!backwards) continue;
    first += (count - 1) * pace;
    corner += static_cast<double>(count - 1) * given.col(static_cast<Eigen::Index>(from));
  }
  if (is_sheared) {
    header.turned = 0.0;  // its position is exact
    header.sheared = skew(given);
    Eigen::Matrix3d::Map(header.shear.data()) = given * directions.inverse() * turn;
  }
  for (std::size_t axis = 0; axis < 3; ++axis)
    header.origin.at(axis) = unit * corner[static_cast<Eigen::Index>(axis)];
  std::vector<std::int32_t> turned;
  turned.reserve(labels.of_voxels.size());
  for (std::ptrdiff_t k = 0; k < header.size[2]; ++k) {
    for (std::ptrdiff_t j = 0; j < header.size[1]; ++j) {
      for (std::ptrdiff_t i = 0; i < header.size[0]; ++i)
        turned.push_back(
            labels.of_voxels[static_cast<std::size_t>(first + i * step[0] + j * step[1] + k * step[2])]);
    }
  }
  labels.of_voxels = std::move(turned);
  return image_labels(header, labels);
}

}  // namespace palpate
