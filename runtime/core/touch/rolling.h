// Rotation of the normal of a sphere's contact as the sphere moves.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <vector>

#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/touch/contact_point.h"
#include "runtime/core/touch/tool.h"

namespace palpate {

// Without friction the contact force acts along the normal n, and n rotates with the relative motion q of
// tool and surface and with the slope theta of the face or edge: in the directions A in which the surface is
// flat by -theta, in others by q / R. The contact point moves along A by q + R theta. Both follow from one
// energy per contact of normal force lambda (the second derivative of the gap times lambda),
//   lambda / 2 R ((R theta + q_A)^2 - q_t^2).
// Its first term is implicit, in the tilt row; the second, a spring of negative stiffness, is included in the
// normal: n + q_t / R, where q_t is predicted from the motion of the device minus that of the surface in the
// last tick.

/// Radius by which contacts of a tool rotate, on a surface with this mean edge length [m].
inline double rolling_radius(const Tool& tool, double edge) noexcept {
  return std::max(tuning.assembly.least_tilt_radius * edge, tool.radius);
}

/// Contact normal after a displacement `shift` of the tool.
inline Vec3 rolled_normal(const Vec3& normal, const Vec3& shift, double radius) noexcept {
  const Vec3 along = shift - shift.dot(normal) * normal;
  const double most = tuning.assembly.most_roll * radius;
  const double length = along.norm();
  return (radius * normal + (length > most ? most / length : 1.0) * along).normalized();
}

/// Number for each of the device's motions; the last is unused.
using Lanes = Eigen::Array4d;
/// Vector for each of the device's motions: x, y and z.
using VectorLanes = std::array<Lanes, 3>;

/// Workspace of linearise_rolling within a tick.
struct RollingScratch {
  /// Closed contact whose normal rotates.
  struct Turning {
    Index row = 0;  ///< row of the contact problem
    std::array<double, 3> weights{};
    Vec3 normal = Vec3::Zero();
    double spring = 0.0;  ///< negative stiffness: normal force over radius [N/m]
  };

  RollingScratch(int dimension, Index max_contacts, Index max_rows);

  std::vector<Turning> turning;  ///< [max_contacts]
  Index turning_count = 0;
  std::vector<Index> following;  ///< [max_rows] closed rows of the contact problem
  Index following_count = 0;
  bool answers = false;              ///< the body responds to the rotation: T and B are valid
  std::vector<double> T;             ///< [(d turning)^2] displacement of the contacts by their forces [m/N]
  std::vector<double> B;             ///< [following x d turning] motion along the rows by the forces [m/N]
  std::vector<Lanes> turning_force;  ///< [d turning] change of the forces on the tool [N]
  std::vector<Lanes> next_force;     ///< [d turning] forces of the next pass [N]
  std::vector<Lanes> row_force;      ///< [following] change of lambda [N]
  std::vector<Lanes> device_change;  ///< [following] db without the rotation of normals [m]
};

}  // namespace palpate
