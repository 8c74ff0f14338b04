// Live bodies that are thrown, and what is kept when nothing acts on them.
#pragma once

#include "runtime/live/live_state.h"
#include "runtime/live/wall_contacts.h"
#include "statics/live_forces.h"

namespace palpate::test {

/// Shifts a body by `shift` [m] and turns it by R about its centre of mass; gives it a velocity [m/s] and an
/// angular velocity [rad/s] about that. Of a body that nothing holds.
inline void throw_body(const LiveBody& body, const Mat3& R, const Vec3& shift, const Vec3& velocity,
                       const Vec3& spin, LiveState& state) {
  const int d = body.dimension();
  Vec3 centre = Vec3::Zero();
  double mass = 0.0;
  for (Index node = 0; node < std::ssize(body.mesh().nodes); ++node) {
    centre += body.mass()[d * node] * node_part(state.x, d, node);
    mass += body.mass()[d * node];
  }
  centre /= mass;
  for (Index node = 0; node < std::ssize(body.mesh().nodes); ++node) {
    const Vec3 arm = R * (node_part(state.x, d, node) - centre);
    state.x.segment(Eigen::Index{d} * node, d) = (centre + shift + arm).head(d);
    state.v.segment(Eigen::Index{d} * node, d) = (velocity + spin.cross(arm)).head(d);
  }
}

/// What is conserved when nothing acts on a body.
struct Momenta {
  Vec3 linear = Vec3::Zero();   ///< [kg m/s]
  Vec3 angular = Vec3::Zero();  ///< about the origin [kg m^2/s]
  double kinetic = 0.0;         ///< energy [J]
  double elastic = 0.0;         ///< energy of deformation [J]
  double potential = 0.0;       ///< energy in its loads, gravity among them [J]

  [[nodiscard]] double energy() const noexcept { return kinetic + elastic + potential; }
};

inline Momenta momenta_of(const LiveBody& body, const LiveState& state) {
  const int d = body.dimension();
  Momenta sum;
  for (Index node = 0; node < std::ssize(body.mesh().nodes); ++node) {
    const Vec3 p = body.mass()[d * node] * node_part(state.v, d, node);
    sum.linear += p;
    sum.angular += node_part(state.x, d, node).cross(p);
    sum.kinetic += 0.5 * p.dot(node_part(state.v, d, node));
  }
  Eigen::VectorXd f;
  sum.elastic = internal_forces(body, state.x, state.plastic, f).energy;
  sum.potential = -body.load().dot(state.x - body.rest());
  return sum;
}

}  // namespace palpate::test
