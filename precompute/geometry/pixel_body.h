// A body as pixels of a picture.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Pixels of a picture that are body; pixel (i, j) is the square [i, i + 1] x [j, j + 1], x to the right and
/// fastest, y up.
struct PixelBody {
  Index width = 0;
  Index height = 0;
  std::vector<std::uint8_t> inside;  ///< [width * height] 1 for body

  [[nodiscard]] std::size_t at(Index i, Index j) const noexcept {
    return static_cast<std::size_t>(i) + static_cast<std::size_t>(width) * static_cast<std::size_t>(j);
  }
  /// False beyond the rim.
  [[nodiscard]] bool is_body(Index i, Index j) const noexcept {
    return i >= 0 && j >= 0 && i < width && j < height && inside[at(i, j)] != 0;
  }
};

/// Throws Error for a picture without a body.
[[noreturn]] void fail_on_no_body(const std::string& where);

/// Reduces the picture to one body that touches itself nowhere at a corner only: removes parts (pixels
/// connected through sides) smaller than 1 % of the largest, fills pixels at such corners, and fills holes of
/// a few pixels, each reported in `notes`. Throws Error (where = `where`) if there is no body, if several
/// large ones remain, and if two of these touch at a corner; places are columns and rows from the picture's
/// top left.
void keep_one_body(PixelBody& body, const std::string& where, std::vector<std::string>& notes);

/// A corner of pixels.
using LatticePoint = std::array<Index, 2>;

/// Closed lines of pixel sides between body and background, with the body on their left: the outer one, then
/// the holes. Requires the result of keep_one_body.
std::vector<std::vector<LatticePoint>> trace_outlines(const PixelBody& body);

}  // namespace palpate
