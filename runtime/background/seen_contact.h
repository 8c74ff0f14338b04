// Contact point for display.
#pragma once

#include "runtime/body/body.h"
#include "runtime/core/tick/state.h"

namespace palpate {

struct SeenContact {
  Vec3 position;  ///< on the deformed surface [m]
  Vec3 normal;    ///< outward normal
  Vec3 force;     ///< force on the body [N]
  bool held = false;
};

/// Returns a contact point of the last tick for display. The normal of one held by a grab is that of its
/// deformed simplex.
SeenContact seen_contact(const Body& body, const State& state, const ContactPoint& contact) noexcept;

}  // namespace palpate
