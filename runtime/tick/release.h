// A body that is let go begins to move freely.
#pragma once

#include "runtime/tick/state.h"

namespace palpate {

/// Whether a body with dynamics is let go in this tick: some tool has lost what it touched in the tick
/// before, or ended its hold.
bool is_released(const Body& body, const State& state) noexcept;

/// Turns forces that ended with this tick into free motion (theory.md section 5), and ends the tick of the
/// motion.
void release(const Body& body, State& state) noexcept;

}  // namespace palpate
