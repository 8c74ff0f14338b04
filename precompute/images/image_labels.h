// A labelled image as sent by the child that reads it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "base/child_process.h"
#include "meshes/mesh.h"
#include "precompute/description/description.h"

namespace palpate {

enum ReadStatus : int { read_ok = 0, not_an_image = 1, not_scalar = 2 };

struct ImageHeader {
  std::array<Index, 3> size{};
  std::array<double, 3> spacing{};
  std::array<double, 3> origin{};
  double turned = 0.0;   ///< largest angle between an axis of the image and the nearest of space [degrees]
  double sheared = 0.0;  ///< largest deviation of two axes from a right angle [degrees]; 0: no `shear`
  /// Matrix from positions about the origin to those of the body in space; column-major.
  std::array<double, 9> shear = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  double unit = 0.0;                   ///< unit of the file's lengths [mm]; 0: not given
  double lowest = 0.0, highest = 0.0;  ///< of the values
  bool whole = true;                   ///< all values are whole numbers
};

/// Voxels as labels.
struct Labels {
  std::vector<std::int32_t> of_voxels;
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;  ///< of the image's values
  bool whole = true;                                                           ///< all are whole numbers
};

/// Labels from rounded values, NaN as 0; with a range 1 for values in it, 0 for others.
template <class ValueAt>
Labels labels_from(std::size_t voxels, const std::optional<ValueRange>& range, const ValueAt& value_at) {
  constexpr double most = 2147483647.0, unnoticed = 1e-3;  // slopes of headers are no exact numbers
  Labels labels;
  labels.of_voxels.reserve(voxels);
  for (std::size_t v = 0; v < voxels; ++v) {
    const double value = value_at(v);
    const double rounded = std::isnan(value) ? 0.0 : std::round(std::clamp(value, -most, most));
    labels.of_voxels.push_back(range ? static_cast<std::int32_t>(value >= range->low && value <= range->high)
                                     : static_cast<std::int32_t>(rounded));
    if (std::isnan(value)) continue;
    labels.lowest = std::min(labels.lowest, value);
    labels.highest = std::max(labels.highest, value);
    labels.whole = labels.whole && !(std::abs(value - rounded) > unnoticed && std::abs(value) < most);
  }
  return labels;
}

/// Bytes of the header, followed by the labels with x fastest.
inline ChildResult image_labels(ImageHeader header, const Labels& labels) {
  header.lowest = labels.lowest;
  header.highest = labels.highest;
  header.whole = labels.whole;
  ChildResult result;
  append_array(result.bytes, std::span<const ImageHeader>(&header, 1));
  append_array(result.bytes, std::span<const std::int32_t>(labels.of_voxels));
  return result;
}

}  // namespace palpate
