// How the normal of a sphere's contact turns as the sphere moves.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <vector>

#include "runtime/solve/tick_tuning.h"
#include "runtime/touch/contact_point.h"
#include "runtime/touch/tool.h"

namespace palpate {

// Without friction the contact force is along the normal n, and n turns with the relative motion q of tool
// and surface and the slope theta of the face or edge: on what is flat (A) by -theta, elsewhere by q / R. The
// foot moves along A by q + R theta. Both follow from one energy per contact of normal force lambda (the
// second derivative of the gap times lambda),
//   lambda / 2 R ((R theta + q_A)^2 - q_t^2),
// the first term of which is the tilt row's, implicit; the second, a spring that pushes, is taken into the
// normal: n + q_t / R, where q_t is foreseen from the motion of the device less the surface's in the tick
// before.

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

/// A figure for each of the device's motions; the last is not used.
using Lanes = Eigen::Array4d;
/// A vector for each of the device's motions: its x, y and z.
using VectorLanes = std::array<Lanes, 3>;

/// What linearise_rolling keeps within a tick.
struct RollingScratch {
  /// A closed contact whose normal turns.
  struct Turning {
    Index row = 0;  ///< of the contact problem
    std::array<double, 3> weights{};
    Vec3 normal = Vec3::Zero();
    double spring = 0.0;  ///< by which it pushes: normal force over radius [N/m]
  };

  RollingScratch(int dimension, Index max_contacts, Index max_rows);

  std::vector<Turning> turning;  ///< [max_contacts]
  Index turning_count = 0;
  std::vector<Index> following;  ///< [max_rows] rows of the contact problem that are closed
  Index following_count = 0;
  bool answers = false;              ///< the body moves by the turning: T and B are there
  std::vector<double> T;             ///< [(d turning)^2] what turning forces move their contacts [m/N]
  std::vector<double> B;             ///< [following x d turning] what they move along the rows [m/N]
  std::vector<Lanes> turning_force;  ///< [d turning] change of the forces on the tool [N]
  std::vector<Lanes> next_force;     ///< [d turning] of the next pass [N]
  std::vector<Lanes> row_force;      ///< [following] change of lambda [N]
  std::vector<Lanes> device_change;  ///< [following] db without the turning [m]
};

}  // namespace palpate
