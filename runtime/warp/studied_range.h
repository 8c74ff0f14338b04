// How far a body may turn until its forces are wrong.
#pragma once

#include <optional>

#include "runtime/body/body.h"

namespace palpate {

/// Rotation of the surface [rad] up to which forces were found to be within 5 % of a corotational body, for
/// what `body` is: of small strain or warped. By the study in its file, without one by that of a cantilever
/// that a force along its end bends (docs/measurements/live). Nothing for a live body, which turns as far as
/// it likes.
std::optional<double> studied_rotation(const Body& body) noexcept;

}  // namespace palpate
