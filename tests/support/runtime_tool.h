// Moves of tools and looks at contacts for the tests of the tick.
#pragma once

#include <gtest/gtest.h>

#include <limits>

#include "runtime/body/body.h"
#include "runtime/core/tick/step.h"

namespace palpate::test {

inline ToolPose pose(const Vec3& position, bool grab = false) {
  ToolPose tool;
  tool.position = position;
  tool.grab = grab;
  return tool;
}

/// A tool whose force is the contact's own.
inline Tool plain(Tool tool) {
  tool.hand_over = std::numeric_limits<double>::infinity();
  return tool;
}

/// To a pose in equal steps, keeping the orientation of `to`.
inline void go(const Body& body, State& state, const Vec3& from, const ToolPose& to, int ticks) {
  ToolPose now = to;
  for (int k = 1; k <= ticks; ++k) {
    now.position = from + (to.position - from) * k / ticks;
    step(body, state, now);
  }
}

inline void hold(const Body& body, State& state, const ToolPose& at, int ticks) {
  for (int k = 0; k < ticks; ++k) step(body, state, at);
}

/// What is normal and what is tangential of a contact's force.
inline double normal_force(const ContactPoint& contact) {
  return contact.force.dot(contact.frame.col(0));
}
inline Vec3 friction_force(const ContactPoint& contact) {
  return contact.force - normal_force(contact) * contact.frame.col(0);
}

/// Where a contact's material point is after the tick.
inline Vec3 place_now(const State& state, const ContactPoint& contact) {
  Vec3 place = Vec3::Zero();
  for (std::size_t n = 0; n < 3; ++n) {
    if (contact.nodes[n] >= 0) place += contact.weights[n] * state.surface.tree.position(contact.nodes[n]);
  }
  return place;
}

/// How far a tool that does not turn slid along the surface at a contact, in the tick's last pass.
inline Vec3 slip(const State& state, const ContactPoint& contact) {
  const ToolState& tool = state.tools[static_cast<std::size_t>(contact.tool)];
  const Vec3 of_tool = tool.pose.position - (contact.position - contact.arm);
  const Vec3 relative = of_tool - (place_now(state, contact) - contact.position);
  return relative - relative.dot(contact.frame.col(0)) * contact.frame.col(0);
}

}  // namespace palpate::test
