// A labelled image as the child that reads it sends it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "base/child_process.h"
#include "meshes/mesh.h"

namespace palpate {

enum ReadStatus : int { read_ok = 0, not_an_image = 1, not_scalar = 2 };

struct ImageHeader {
  std::array<Index, 3> size{};
  std::array<double, 3> spacing{};
  std::array<double, 3> origin{};
  double turned = 0.0;  ///< largest angle between an axis of the image and the nearest of space [degrees]
};

/// A value as a label: rounded, what is not a number as 0.
inline std::int32_t rounded_label(double value) {
  constexpr double most = 2147483647.0;
  return static_cast<std::int32_t>(std::lround(std::isnan(value) ? 0.0 : std::clamp(value, -most, most)));
}

/// Values as labels, each shift + slope * value.
template <class T>
std::vector<std::int32_t> rounded_labels(std::span<const T> values, double slope = 1.0, double shift = 0.0) {
  std::vector<std::int32_t> labels;
  labels.reserve(values.size());
  for (const T value : values) labels.push_back(rounded_label(slope * static_cast<double>(value) + shift));
  return labels;
}

/// Labels with x running fastest, after their header.
inline ChildResult image_labels(const ImageHeader& header, const std::vector<std::int32_t>& labels) {
  ChildResult result;
  append_array(result.bytes, std::span<const ImageHeader>(&header, 1));
  append_array(result.bytes, std::span<const std::int32_t>(labels));
  return result;
}

}  // namespace palpate
