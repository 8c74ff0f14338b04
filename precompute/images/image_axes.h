// Images in space with axes in any order.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "precompute/images/image_labels.h"

namespace palpate {

/// Position of an image in space.
struct ImagePlace {
  /// Maps a voxel's three numbers, and 1, to its centre: x to the patient's right, y to the front, z to the
  /// head.
  Eigen::Matrix<double, 3, 4> to_space = Eigen::Matrix<double, 3, 4>::Identity();
  double unit = 0.0;  ///< unit of lengths there [mm]; 0: not given in the file, assumed to be millimetres
};

/// The image along the axes of space, in mm: its own axes are permuted and reversed to be as near to those as
/// possible. If they are not at right angles, as with a tilted gantry, those of the grid are, and its header
/// has the shear of the body. `labels` has `size` voxels, the first axis fastest.
ChildResult along_space(ImagePlace place, std::array<std::size_t, 3> size, Labels labels);

}  // namespace palpate
