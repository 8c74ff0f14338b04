// Up to where a curve of errors is small.
#pragma once

#include <span>

namespace palpate {

inline constexpr double good_bending_error = 0.05;  ///< of a force: smaller ones are hardly felt

/// The rotation up to which errors stay within `most`, without their sign, by straight lines between the
/// levels, from none at 0: of errors [L] at rotations [L] that ascend. The last rotation where all of them
/// do.
double range_within(std::span<const double> rotation, std::span<const double> errors, double most) noexcept;

}  // namespace palpate
