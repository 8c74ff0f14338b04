// Nearest points of a flat disc and a part of the surface.
#pragma once

#include <array>

#include "runtime/core/solve/nearest_point.h"

namespace palpate {

/// Flat circular disc without thickness.
struct Disc {
  Vec3 centre;
  Vec3 axis;      ///< unit normal of the disc
  double radius;  ///< > 0 [m]
};

/// Nearest point of a disc to p. Finite for finite input, as are the results below.
Vec3 nearest_on_disc(const Disc& disc, const Vec3& p) noexcept;

/// Nearest points of a disc and line a b. If the line cuts the disc the distance is 0. If it is parallel,
/// returns one of the nearest pairs.
NearestPoint nearest_of_disc_and_line(const Disc& disc, const Vec3& a, const Vec3& b) noexcept;

/// Nearest points of a disc and triangle a b c. If they intersect the distance is 0. If they are parallel,
/// returns one of the nearest pairs.
NearestPoint nearest_of_disc_and_triangle(const Disc& disc, const Vec3& a, const Vec3& b,
                                          const Vec3& c) noexcept;

/// Parameters of line a b, ascending, at which it crosses the disc's rim as seen along the axis; they may lie
/// outside 0 to 1. NaN if it passes beside the disc or is parallel to the axis.
std::array<double, 2> shares_over_rim(const Disc& disc, const Vec3& a, const Vec3& b) noexcept;

}  // namespace palpate
