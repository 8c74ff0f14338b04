// Nearest points of a tool's core and a part of the surface.
#pragma once

#include <array>

#include "base/vectors.h"

namespace palpate {

/// Nearest points of a point or segment and a simplex (triangle, or line with its third corner ignored).
struct NearestPoint {
  std::array<double, 3> weights{};  ///< barycentric, >= 0, sum 1; exactly 0 for corners that do not belong to
                                    ///< the nearest vertex or edge
  Vec3 on_simplex = Vec3::Zero();
  Vec3 on_core = Vec3::Zero();
  double squared_distance = 0.0;  ///< [m^2]
};

/// Nearest point of p on triangle a b c (Ericson, Real-Time Collision Detection, section 5.1.5). A triangle
/// without area is treated as its longest edge. Finite for finite input.
NearestPoint nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) noexcept;

/// Nearest point of p on line a b.
NearestPoint nearest_on_line(const Vec3& p, const Vec3& a, const Vec3& b) noexcept;

/// Nearest points of segment p q and triangle a b c. If the segment cuts the triangle the distance is 0. If
/// it is parallel, returns one of the nearest pairs.
NearestPoint nearest_of_segment_and_triangle(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b,
                                             const Vec3& c) noexcept;

/// Nearest points of segment p q and line a b.
NearestPoint nearest_of_segments(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b) noexcept;

}  // namespace palpate
