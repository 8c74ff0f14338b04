// Contact in one tick: the contact problem at the present positions, solved by Newton passes.
#pragma once

#include <cstdint>

#include "runtime/core/tick/state.h"

namespace palpate {

/// Passes scratch.problem.lambda to the contact points, the near field and the tools' contact wrenches.
void apply_forces(State& state, const Scratch& scratch) noexcept;

/// Result of contact in a tick.
enum class ContactOutcome : std::uint8_t {
  solved,
  unchanged,   ///< nothing has moved: contact points, forces and positions equal those of the last tick
  not_finite,  ///< StepStatus::result_not_finite: everything except the contact points is unchanged
};

/// Finds the contact points and their forces, and moves tools and near surface accordingly. A pass is a
/// Newton step: one is enough unless contact slips far in a tick. Switches to the requested patch.
ContactOutcome solve_contact(const ElasticBody& body, State& state, Scratch& scratch) noexcept;

}  // namespace palpate
