// Black-and-white pictures from PNG and PBM files.
#pragma once

#include "precompute/description/description.h"
#include "precompute/geometry/pixel_body.h"

namespace palpate {

/// Reads a picture. The body is the pixels that are not black or, if marked `dark`, the black ones. PNG: a
/// pixel is black if its grey value (0 to 255; colours by luminance, transparent pixels over background) is
/// below 128. PBM (plain P1, raw P4): if its bit is 1. The file's first bytes determine the format. Throws
/// Error for a file that is neither, damaged, or too large.
PixelBody read_picture(const PictureGeometry& picture);

}  // namespace palpate
