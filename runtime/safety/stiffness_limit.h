// Stiffness limits of a device.
#pragma once

#include "base/vectors.h"

namespace palpate {

/// Returns the symmetric part with its eigenvalues clamped to [0, most] [N/m]: no direction is stiffer than
/// `most`, and none has negative stiffness. Zero if an entry is not plausible.
Mat3 limited_stiffness(const Mat3& stiffness, double most) noexcept;

}  // namespace palpate
