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

}  // namespace

SeenContact seen_contact(const Body& body, const State& state, const ContactPoint& contact) noexcept {
  return {surface_position(state, contact),
          contact.held ? outward_normal(state.surface.tree, nodes_of(body, contact.simplex))
                       : Vec3(contact.frame.col(0)),
          Vec3::Zero() - contact.force, contact.held};
}

}  // namespace palpate
