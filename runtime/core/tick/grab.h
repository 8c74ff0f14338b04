// Grabs: tools that hold the touched surface.
#pragma once

#include "runtime/core/tick/state.h"

namespace palpate {

/// Starts and ends the holds of all tools as requested by their devices. A grab holds the closed contacts of
/// the last tick; if there are none, the nearest point of the surface within the tool's reach. Held points
/// are fixed to the tool at their present positions, so that no force changes at the grab.
void update_holds(const ElasticBody& body, State& state, const LastContacts& remembered) noexcept;

}  // namespace palpate
