// Black-and-white pictures from PNG and PBM files.
#pragma once

#include "precompute/description/description.h"
#include "precompute/geometry/pixel_body.h"

namespace palpate {

/// Reads a picture; what is not black is body, or what is, where it is said to be dark. PNG: a pixel is black
/// when its grey value (0 to 255; colours by their luminance, transparent ones over what is no body) is below
/// 128. PBM (plain P1, raw P4): where the bit is 1. The file's first bytes tell which it is. Throws Error for
/// a file that is neither, damaged, or too large.
PixelBody read_picture(const PictureGeometry& picture);

}  // namespace palpate
