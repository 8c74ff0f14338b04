// Linearisation of the tick's result at the device's pose.
#pragma once

#include "runtime/core/tick/state.h"

namespace palpate {

/// Computes the local model of each tool, after the contact problem was solved and the forces were applied.
void linearise(const ElasticBody& body, State& state, Scratch& scratch) noexcept;

}  // namespace palpate
