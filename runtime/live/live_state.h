// State of a live body.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "statics/live_body.h"

namespace palpate {

/// Positions and velocities of a body. Copies are complete.
struct LiveState {
  /// At rest in the shape of the mesh, held nodes at their prescribed position.
  explicit LiveState(const LiveBody& body);

  Eigen::VectorXd x;              ///< [d N] positions [m]
  Eigen::VectorXd v;              ///< [d N] velocities [m/s]
  Eigen::VectorXd a;              ///< [d N] accelerations without walls; for Newmark [m/s^2]
  std::vector<Mat3> plastic;      ///< [quadrature points] plastic strain; empty without plasticity
  bool has_acceleration = false;  ///< `a` is valid; otherwise Newmark's method computes it first
  double time = 0.0;              ///< [s]
};

/// Translates a body by `shift` [m] and rotates it by R about its centre of mass; gives it a velocity [m/s]
/// and an angular velocity [rad/s] about that centre. For a body without supports.
void throw_body(const LiveBody& body, const Mat3& R, const Vec3& shift, const Vec3& velocity,
                const Vec3& spin, LiveState& state);

/// Quantities that are conserved without external forces.
struct Momenta {
  Vec3 linear = Vec3::Zero();   ///< [kg m/s]
  Vec3 angular = Vec3::Zero();  ///< about the origin [kg m^2/s]
  double kinetic = 0.0;         ///< kinetic energy [J]
  double elastic = 0.0;         ///< strain energy [J]
  double potential = 0.0;       ///< potential energy of the loads, including gravity [J]

  [[nodiscard]] double energy() const noexcept { return kinetic + elastic + potential; }
};
Momenta momenta_of(const LiveBody& body, const LiveState& state);

}  // namespace palpate
