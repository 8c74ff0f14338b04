// Range of rotations over which errors stay small.
#pragma once

#include <span>

namespace palpate {

inline constexpr double good_bending_error = 0.05;  ///< of a force; smaller errors are hardly felt

/// Rotation up to which |errors| stay within `most`, interpolated linearly between the levels, starting from
/// no error at 0. `errors` [L] belong to `rotation` [L], which ascends. The last rotation if all of them stay
/// within.
double range_within(std::span<const double> rotation, std::span<const double> errors, double most) noexcept;

}  // namespace palpate
