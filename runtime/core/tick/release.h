// Release of a body, after which it moves freely.
#pragma once

#include "runtime/core/tick/state.h"

namespace palpate {

/// True if a body with dynamics is released in this tick: some tool has lost the contact of the last tick, or
/// ended its hold.
bool is_released(const ElasticBody& body, const State& state) noexcept;

/// Converts forces that ended with this tick into free motion (theory.md section 5), and ends the tick of the
/// motion.
void release(const ElasticBody& body, State& state) noexcept;

}  // namespace palpate
