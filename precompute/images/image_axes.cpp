#include "precompute/images/image_axes.h"

#include <nifti2_io.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate {
namespace {

/// Which axis of the image runs along each of space, and whether backwards.
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

}  // namespace

ChildResult along_space(const ImagePlace& place, const std::array<std::size_t, 3>& size,
                        const std::vector<std::int32_t>& labels) {
  const Axes axes = axes_of(place.to_space);
  const double unit = place.unit;
  const Eigen::Matrix3d directions = place.to_space.leftCols<3>();
  Eigen::Vector3d corner = place.to_space.col(3);
  const std::array<std::size_t, 3> stride = {1, size[0], size[0] * size[1]};
  ImageHeader header;
  std::array<std::ptrdiff_t, 3> step{};
  std::ptrdiff_t first = 0;
  for (std::size_t along = 0; along < 3; ++along) {
    const std::size_t from = axes.from.at(along);
    const auto column = directions.col(static_cast<Eigen::Index>(from));
    const auto count = static_cast<std::ptrdiff_t>(size.at(from)),
               pace = static_cast<std::ptrdiff_t>(stride.at(from));
    header.size.at(along) = static_cast<Index>(count);
    header.spacing.at(along) = unit * column.norm();
    const double cosine = std::abs(column[static_cast<Eigen::Index>(along)]) / column.norm();
    header.turned = std::max(header.turned, std::acos(std::min(cosine, 1.0)) * 180.0 / std::numbers::pi);
    const bool backwards = axes.backwards.at(along);
    step.at(along) = backwards ? -pace : pace;
    if (!backwards) continue;
    first += (count - 1) * pace;
    corner += static_cast<double>(count - 1) * column;
  }
  for (std::size_t axis = 0; axis < 3; ++axis)
    header.origin.at(axis) = unit * corner[static_cast<Eigen::Index>(axis)];
  std::vector<std::int32_t> turned;
  turned.reserve(labels.size());
  for (std::ptrdiff_t k = 0; k < header.size[2]; ++k) {
    for (std::ptrdiff_t j = 0; j < header.size[1]; ++j) {
      for (std::ptrdiff_t i = 0; i < header.size[0]; ++i)
        turned.push_back(labels[static_cast<std::size_t>(first + i * step[0] + j * step[1] + k * step[2])]);
    }
  }
  return image_labels(header, turned);
}

}  // namespace palpate
