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

double degrees(double cosine) {
  return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi;
}

/// Makes the axes orthogonal. With columns = Q R (Gram and Schmidt, the axis of the longest step last, so
/// that it is finer ones that are rounded to) a voxel s lies at Q diag(R) t with t_a = s_a + sum of R_ab /
/// R_aa s_b over b > a: rows are moved by whole voxels, and none is lost. Returns the largest angle by which
/// two axes missed a right one [degrees], 0 where nothing had to move.
double straighten(ImagePlace& place, std::array<std::size_t, 3>& size, Labels& labels,
                  const std::string& where) {
  Eigen::Matrix3d columns = place.to_space.leftCols<3>();
  std::array<int, 3> order = {0, 1, 2};
  std::ranges::stable_sort(order, {}, [&](int axis) { return columns.col(axis).norm(); });
  Eigen::Matrix3d shift = Eigen::Matrix3d::Zero();  // [voxel] of an axis, per voxel of another
  std::array<double, 3> low{}, high{};              // [voxel] what an axis is moved by
  double angle = 0.0, most = 0.0;
  for (std::size_t b = 0; b < 3; ++b) {
    const int axis = order.at(b);
    for (std::size_t a = 0; a < b; ++a) {
      const int before = order.at(a);
      const Eigen::Vector3d along = columns.col(before);
      const double moved = along.dot(place.to_space.col(axis)) / along.squaredNorm();
      angle = std::max(angle, std::abs(90.0 - degrees(along.dot(place.to_space.col(axis)) / along.norm() /
                                                      place.to_space.col(axis).norm())));
      columns.col(axis) -= moved * along;
      shift(before, axis) = moved;
      const double last = moved * static_cast<double>(size.at(static_cast<std::size_t>(axis)) - 1);
      low.at(static_cast<std::size_t>(before)) += std::min(last, 0.0);
      high.at(static_cast<std::size_t>(before)) += std::max(last, 0.0);
      most = std::max(most, std::abs(last));
    }
  }
  if (!(most >= 0.5) || !columns.allFinite()) return 0.0;  // no voxel moves, or the matrix is singular
  std::array<std::size_t, 3> wider{};
  double voxels = 1.0;
  std::string product;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low.at(axis) = std::floor(low.at(axis));
    const double width = static_cast<double>(size.at(axis)) + std::ceil(high.at(axis)) - low.at(axis);
    product += fmt::format("{}{}", product.empty() ? "a sheared box of " : " x ", width);
    voxels *= width;
    if (voxels <= static_cast<double>(most_voxels)) wider.at(axis) = static_cast<std::size_t>(width);
    place.to_space.col(3) += low.at(axis) * columns.col(static_cast<int>(axis));
  }
  check_voxels(product, voxels, 4.0, where);
  std::vector<std::int32_t> moved(wider[0] * wider[1] * wider[2], 0);
  std::size_t v = 0;
  for (std::size_t k = 0; k < size[2]; ++k) {
    for (std::size_t j = 0; j < size[1]; ++j) {
      for (std::size_t i = 0; i < size[0]; ++i, ++v) {
        const Eigen::Vector3d s(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k));
        std::array<std::size_t, 3> t{};
        for (int axis = 0; axis < 3; ++axis)
          t.at(static_cast<std::size_t>(axis)) = static_cast<std::size_t>(
              s[axis] + std::round(shift.row(axis).dot(s)) - low.at(static_cast<std::size_t>(axis)));
        moved[t[0] + wider[0] * (t[1] + wider[1] * t[2])] = labels.of_voxels[v];
      }
    }
  }
  place.to_space.leftCols<3>() = columns;
  size = wider;
  labels.of_voxels = std::move(moved);
  return angle;
}

}  // namespace

ChildResult along_space(ImagePlace place, std::array<std::size_t, 3> size, Labels labels,
                        const std::string& where) {
  const double sheared = straighten(place, size, labels, where);
  const Axes axes = axes_of(place.to_space);
  const double unit = place.unit > 0.0 ? place.unit : 1.0;
  const Eigen::Matrix3d directions = place.to_space.leftCols<3>();
  Eigen::Vector3d corner = place.to_space.col(3);
  const std::array<std::size_t, 3> stride = {1, size[0], size[0] * size[1]};
  ImageHeader header;
  header.unit = place.unit;
  header.sheared = sheared;
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
    header.turned = std::max(header.turned, degrees(cosine));
    const bool backwards = axes.backwards.at(along);
    step.at(along) = backwards ? -pace : pace;
    if (!backwards) continue;
    first += (count - 1) * pace;
    corner += static_cast<double>(count - 1) * column;
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
