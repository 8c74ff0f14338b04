#include "runtime/live/live_state.h"

#include <Eigen/Geometry>

#include "runtime/live/wall_contacts.h"
#include "statics/live_forces.h"

namespace palpate {

LiveState::LiveState(const LiveBody& body)
    : x(body.start()), v(Eigen::VectorXd::Zero(body.dofs())), a(Eigen::VectorXd::Zero(body.dofs())) {
  if (body.options().plasticity.flows())
    plastic.assign(static_cast<std::size_t>(body.all_points()), Mat3::Zero());
}

void throw_body(const LiveBody& body, const Mat3& R, const Vec3& shift, const Vec3& velocity,
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

Momenta momenta_of(const LiveBody& body, const LiveState& state) {
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

}  // namespace palpate
