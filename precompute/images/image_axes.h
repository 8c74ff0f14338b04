// Images that lie in space with their axes in any order.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "precompute/images/image_labels.h"

namespace palpate {

/// Where an image is.
struct ImagePlace {
  /// From a voxel's three numbers, and 1, to its centre: x to the patient's right, y to the front, z to the
  /// head.
  Eigen::Matrix<double, 3, 4> to_space = Eigen::Matrix<double, 3, 4>::Identity();
  double unit = 0.0;  ///< of lengths there [mm]; 0: the file does not say, which is taken for millimetres
};

/// The image along the axes of space: its own are exchanged and turned round so that they come as near to
/// those as they can; in mm. Where they are not at right angles, as with a tilted gantry, the grid has right
/// ones and its header how the body is sheared. `labels` has `size` voxels, the first axis running fastest.
ChildResult along_space(ImagePlace place, std::array<std::size_t, 3> size, Labels labels);

}  // namespace palpate
