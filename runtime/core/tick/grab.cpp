#include "runtime/core/tick/grab.h"

#include <algorithm>

#include "runtime/core/touch/contact_nodes.h"

namespace palpate {
namespace {

/// Position of a surface point at the end of the last tick, consistent with the tool's pose. (A contact
/// point's own position is that at the beginning.)
Vec3 last_place(const ElasticBody& body, const SurfaceState& surface, const ContactPoint& contact) noexcept {
  Vec3 place = Vec3::Zero();
  for_each_node(body, surface.near, contact, [&](Index node, double weight) {
    place += weight * surface.tree.position(node);
    if (surface.motion.active()) place -= weight * surface.motion.change(node);
  });
  return place;
}

void hold_contact(const ElasticBody& body, State& state, const ContactPoint& contact) noexcept {
  const ToolState& tool = state.tools[contact.tool];
  ContactPoint held = contact;
  held.held = true;
  held.rolls = false;
  held.feature = -1 - state.held_count;
  held.frame.setIdentity();
  held.tool_point =
      tool.pose.orientation.conjugate() * (last_place(body, state.surface, contact) - tool.pose.position);
  state.contact_points[state.held_count++] = held;
}

/// Holds the nearest point of the surface within reach, as a contact.
bool reach_out(const ElasticBody& body, State& state, Index number) noexcept {
  ToolState& tool = state.tools[number];
  const NearestSimplex found = state.surface.tree.nearest(tool.pose.position);
  if (!(found.nearest.squared_distance <= tool.tool.reach * tool.tool.reach)) return false;
  ContactPoint contact;
  contact.tool = number;
  contact.simplex = found.simplex;
  contact.weights = found.nearest.weights;
  contact.position = found.nearest.on_simplex;
  const auto d = static_cast<std::size_t>(body.dimension());
  bool free = false;
  for (std::size_t k = 0; k < d; ++k) {
    if (contact.weights[k] == 0.0) continue;
    contact.nodes[k] = body.simplices()[d * static_cast<std::size_t>(found.simplex) + k];
    free = free || body.surface_moves(contact.nodes[k]);
  }
  if (!free) return false;
  hold_contact(body, state, contact);
  return true;
}

/// Starts a grab: closed contacts are held; if there are none, the surface within reach.
void begin_hold(const ElasticBody& body, State& state, const LastContacts& remembered,
                Index number) noexcept {
  ToolState& tool = state.tools[number];
  const Index before = state.held_count;
  for (Index k = 0; k < remembered.count && state.held_count < state.max_contacts(); ++k) {
    const ContactPoint& contact = remembered.contacts[k];
    if (contact.tool == number && !contact.held && contact.force.dot(contact.frame.col(0)) > 0.0)
      hold_contact(body, state, contact);
  }
  tool.holding = state.held_count > before;
  if (tool.holding || state.held_count == state.max_contacts()) return;
  tool.holding = reach_out(body, state, number);
  if (!tool.holding) tool.status |= StepStatus::nothing_in_reach;
}

void end_hold(State& state, Index number) noexcept {
  const auto begin = state.contact_points.begin();
  const auto end = std::remove_if(begin, begin + state.held_count,
                                  [&](const ContactPoint& contact) { return contact.tool == number; });
  state.held_count = static_cast<Index>(end - begin);
  state.tools[number].holding = false;
}

}  // namespace

void update_holds(const ElasticBody& body, State& state, const LastContacts& remembered) noexcept {
  for (Index k = 0; k < static_cast<Index>(state.tools.size()); ++k) {
    const ToolState& tool = state.tools[k];
    if (tool.device.grab && !tool.holding && tool.placed) begin_hold(body, state, remembered, k);
    if (!tool.device.grab && tool.holding) end_hold(state, k);
  }
}

}  // namespace palpate
