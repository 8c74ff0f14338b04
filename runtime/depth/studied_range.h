// Range of rotation in which a body's forces are accurate.
#pragma once

#include <optional>

#include "runtime/body/body.h"

namespace palpate {

/// Rotation of the surface [rad] up to which forces are within 5 % of those of a corotational body, for the
/// law of `body`: small strain or two levels: those of a cantilever bent by a force at its end
/// (docs/measurements/live). Empty for a live body, whose rotation is not limited.
std::optional<double> studied_rotation(const Body& body) noexcept;

}  // namespace palpate
