// The tick's result near the device's pose, to first order.
#pragma once

#include "runtime/tick/state.h"

namespace palpate {

/// Fills the local model of each tool after the contact problem was solved and the forces were applied.
void linearise(const Body& body, State& state, Scratch& scratch) noexcept;

}  // namespace palpate
