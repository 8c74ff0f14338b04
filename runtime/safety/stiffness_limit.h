// No stiffer than the device can show.
#pragma once

#include "meshes/mesh.h"

namespace palpate {

/// The symmetric part, its eigenvalues clamped to [0, most] [N/m]: no direction is stiffer than `most`, none
/// pushes the hand on. Zero where it is no number.
Mat3 limited_stiffness(const Mat3& stiffness, double most) noexcept;

/// Stiffness of the virtual coupling [N/m] with which a body of at most `body` [N/m] is felt with at most
/// `most`: both are in series, 1 / most = 1 / body + 1 / coupling. Infinite (rigid) where the body is softer
/// than that; `most` itself where nothing is known of the body.
double coupling_stiffness(double most, double body) noexcept;

}  // namespace palpate
