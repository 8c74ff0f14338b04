// How the normal of a sphere's contact turns as the sphere moves.
#pragma once

#include <algorithm>

#include "runtime/solve/tick_tuning.h"
#include "runtime/tick/contact_point.h"
#include "runtime/tick/tool.h"

namespace palpate {

// Without friction the contact force is along the normal n, and n turns with the relative motion q of tool
// and surface and the slope theta of the face or edge: on what is flat (A) by -theta, elsewhere by q / R. The
// foot moves along A by q + R theta. Both follow from one energy per contact of normal force lambda (the
// second derivative of the gap times lambda),
//   lambda / 2 R ((R theta + q_A)^2 - q_t^2),
// the first term of which is the tilt row's, implicit; the second, a spring that pushes, is taken into the
// normal: n + q_t / R, where q_t is foreseen from the motion of the device.

/// Radius by which contacts of a tool turn, on a surface with edges of that mean length [m].
inline double rolling_radius(const Tool& tool, double edge) noexcept {
  return std::max(tuning.assembly.least_tilt_radius * edge, tool.radius);
}

/// A contact's normal after the tool has moved by `shift`.
inline Vec3 rolled_normal(const Vec3& normal, const Vec3& shift, double radius) noexcept {
  const Vec3 along = shift - shift.dot(normal) * normal;
  const double most = tuning.assembly.most_roll * radius;
  const double length = along.norm();
  return (radius * normal + (length > most ? most / length : 1.0) * along).normalized();
}

}  // namespace palpate
