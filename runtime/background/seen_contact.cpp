#include "runtime/background/seen_contact.h"

#include "runtime/core/touch/contact_nodes.h"

namespace palpate {
namespace {

/// Position of the deformed surface at a contact.
Vec3 surface_position(const Body& body, const State& state, const ContactPoint& contact) noexcept {
  Vec3 position = Vec3::Zero();
  for_each_node(body, state.surface.near, contact,
                [&](Index node, double weight) { position += weight * state.surface.tree.position(node); });
  return position;
}

/// For a sphere without friction, the normal and the force have rotated within the tick.
Vec3 normal_of(const Body& body, const State& state, const ContactPoint& contact) noexcept {
  if (contact.held) return outward_normal(state.surface.tree, nodes_of(body, contact.simplex));
  if (contact.rolls && !contact.force.isZero(0.0)) return contact.force.normalized();
  return contact.frame.col(0);
}

}  // namespace

SeenContact seen_contact(const Body& body, const State& state, const ContactPoint& contact) noexcept {
  return {surface_position(body, state, contact), normal_of(body, state, contact),
          Vec3::Zero() - contact.force, contact.held};
}

}  // namespace palpate
