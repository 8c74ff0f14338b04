// A body as pixels of a picture.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Which pixels of a picture are body; pixel (i, j) is the square [i, i + 1] x [j, j + 1], x to the right and
/// fastest, y up.
struct PixelBody {
  Index width = 0;
  Index height = 0;
  std::vector<std::uint8_t> inside;  ///< [width * height] 1 where body

  [[nodiscard]] std::size_t at(Index i, Index j) const noexcept {
    return static_cast<std::size_t>(i) + static_cast<std::size_t>(width) * static_cast<std::size_t>(j);
  }
  /// False beyond the rim.
  [[nodiscard]] bool is_body(Index i, Index j) const noexcept {
    return i >= 0 && j >= 0 && i < width && j < height && inside[at(i, j)] != 0;
  }
};

/// Throws Error: there is no body.
[[noreturn]] void fail_on_no_body(const std::string& where);

/// Leaves one body that touches itself nowhere at a corner only: removes parts (pixels connected through
/// sides) smaller than 1 % of the largest, fills pixels at such corners, and fills holes of a few pixels,
/// each told in `notes`. Throws Error (where = `where`) when there is no body, when several large ones are
/// left, and when two of these touch at a corner; places are columns and rows from the picture's top left.
void keep_one_body(PixelBody& body, const std::string& where, std::vector<std::string>& notes);

/// Corner of pixels.
using LatticePoint = std::array<Index, 2>;

/// The closed lines of pixel sides between body and not-body, the body on their left: the outer one, then the
/// holes. Needs what keep_one_body leaves.
std::vector<std::vector<LatticePoint>> trace_outlines(const PixelBody& body);

}  // namespace palpate
