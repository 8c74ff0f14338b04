// A contact point as it is seen.
#pragma once

#include "runtime/tick/state.h"

namespace palpate {

struct SeenContact {
  Vec3 position;  ///< of the surface now [m]
  Vec3 normal;    ///< outward
  Vec3 force;     ///< on the body [N]
  bool held = false;
};

/// A contact point of the last tick as the viewer draws it. The normal of one that a grab holds is that of
/// its simplex as it is now.
SeenContact seen_contact(const Body& body, const State& state, const ContactPoint& contact) noexcept;

}  // namespace palpate
