// Stiffness limits of a device.
#pragma once

#include "base/vectors.h"

namespace palpate {

/// Returns the symmetric part with its eigenvalues clamped to [0, most] [N/m]: no direction is stiffer than
/// `most`, and none has negative stiffness. Zero if an entry is not plausible.
Mat3 limited_stiffness(const Mat3& stiffness, double most) noexcept;

/// Stiffness of the virtual coupling [N/m] with which a body of at most `body` [N/m] is felt with at most
/// `most`. The two are in series: 1 / most = 1 / body + 1 / coupling. Infinite (rigid) if the body is no
/// stiffer than `most`; `most` itself if the body's stiffness is unknown (infinite).
double coupling_stiffness(double most, double body) noexcept;

}  // namespace palpate
