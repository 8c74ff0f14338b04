// Linearisation of the tick's result at the device's pose.
#pragma once

#include "runtime/tick/state.h"

namespace palpate {

/// Computes the local model of each tool, after the contact problem was solved and the forces were applied.
void linearise(const Body& body, State& state, Scratch& scratch) noexcept;

}  // namespace palpate
