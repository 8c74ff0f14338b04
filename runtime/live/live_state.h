// What changes of a live body.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "statics/live_body.h"

namespace palpate {

/// Where a body is and how it moves. Copies are complete.
struct LiveState {
  /// At rest in the mesh's shape, held nodes where they are held.
  explicit LiveState(const LiveBody& body);

  Eigen::VectorXd x;              ///< [d N] positions [m]
  Eigen::VectorXd v;              ///< [d N] velocities [m/s]
  Eigen::VectorXd a;              ///< [d N] accelerations without walls; Newmark's [m/s^2]
  std::vector<Mat3> plastic;      ///< [quadrature points] plastic strain; empty of a body that does not flow
  bool has_acceleration = false;  ///< `a` is of this state; else Newmark's method finds it first
  double time = 0.0;              ///< [s]
};

/// Shifts a body by `shift` [m] and turns it by R about its centre of mass; gives it a velocity [m/s] and an
/// angular velocity [rad/s] about that. Of a body that nothing holds.
void throw_body(const LiveBody& body, const Mat3& R, const Vec3& shift, const Vec3& velocity,
                const Vec3& spin, LiveState& state);

/// What is conserved when nothing acts on a body.
struct Momenta {
  Vec3 linear = Vec3::Zero();   ///< [kg m/s]
  Vec3 angular = Vec3::Zero();  ///< about the origin [kg m^2/s]
  double kinetic = 0.0;         ///< energy [J]
  double elastic = 0.0;         ///< energy of deformation [J]
  double potential = 0.0;       ///< energy in its loads, gravity among them [J]

  [[nodiscard]] double energy() const noexcept { return kinetic + elastic + potential; }
};
Momenta momenta_of(const LiveBody& body, const LiveState& state);

}  // namespace palpate
