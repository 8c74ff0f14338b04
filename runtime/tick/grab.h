// A tool that holds what it touches.
#pragma once

#include "runtime/tick/state.h"

namespace palpate {

/// Begins and ends the holds of all tools as their devices ask: a grab holds the closed contacts of the tick
/// before; if there are none, the nearest place of the surface within the tool's reach. Held places stay
/// where they are on the tool, so that no force changes at the grab.
void update_holds(const Body& body, State& state, const LastContacts& remembered) noexcept;

}  // namespace palpate
