#include "runtime/seen_contact.h"

#include <Eigen/Geometry>

namespace palpate {
namespace {

/// Where the surface is now at a contact.
Vec3 surface_position(const State& state, const ContactPoint& contact) noexcept {
  Vec3 position = Vec3::Zero();
  for (std::size_t k = 0; k < contact.nodes.size(); ++k) {
    if (contact.nodes[k] >= 0) position += contact.weights[k] * state.tree.position(contact.nodes[k]);
  }
  return position;
}

/// Of a simplex as it is now.
Vec3 outward_normal(const Body& body, const State& state, Index simplex) noexcept {
  const auto d = static_cast<std::size_t>(body.dimension());
  const std::span<const Index> nodes = body.simplices().subspan(d * static_cast<std::size_t>(simplex), d);
  const Vec3 a = state.tree.position(nodes[0]);
  const Vec3 ab = state.tree.position(nodes[1]) - a;
  if (d == 2) return Vec3(ab.y(), -ab.x(), 0.0).normalized();
  return ab.cross(state.tree.position(nodes[2]) - a).normalized();
}

}  // namespace

SeenContact seen_contact(const Body& body, const State& state, const ContactPoint& contact) noexcept {
  return {surface_position(state, contact),
          contact.held ? outward_normal(body, state, contact.simplex) : Vec3(contact.frame.col(0)),
          Vec3::Zero() - contact.force, contact.held};
}

}  // namespace palpate
