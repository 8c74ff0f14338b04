// A labelled image as the child that reads it sends it.
#pragma once

#include <array>
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

/// Labels with x running fastest, after their header.
inline ChildResult image_labels(const ImageHeader& header, const std::vector<std::int32_t>& labels) {
  ChildResult result;
  append_array(result.bytes, std::span<const ImageHeader>(&header, 1));
  append_array(result.bytes, std::span<const std::int32_t>(labels));
  return result;
}

}  // namespace palpate
