#include "runtime/background/seen_contact.h"

namespace palpate {
namespace {

/// Where the surface is now at a contact.
Vec3 surface_position(const State& state, const ContactPoint& contact) noexcept {
  Vec3 position = Vec3::Zero();
  for (std::size_t k = 0; k < contact.nodes.size(); ++k) {
    if (contact.nodes[k] >= 0) position += contact.weights[k] * state.surface.tree.position(contact.nodes[k]);
  }
  return position;
}

/// The normal of a sphere that slides without friction has turned within the tick, and its force with it.
Vec3 normal_of(const Body& body, const State& state, const ContactPoint& contact) noexcept {
  if (contact.held) return outward_normal(state.surface.tree, nodes_of(body, contact.simplex));
  if (contact.rolls && !contact.force.isZero(0.0)) return contact.force.normalized();
  return contact.frame.col(0);
}

}  // namespace

SeenContact seen_contact(const Body& body, const State& state, const ContactPoint& contact) noexcept {
  return {surface_position(state, contact), normal_of(body, state, contact), Vec3::Zero() - contact.force,
          contact.held};
}

}  // namespace palpate
