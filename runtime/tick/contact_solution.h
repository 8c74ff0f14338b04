// Contact in one tick: the contact problem about where everything is, solved by Newton passes.
#pragma once

#include <cstdint>

#include "runtime/tick/state.h"

namespace palpate {

/// Fills scratch.problem.lambda for the rows of scratch.problem: the active set where nothing rubs, otherwise
/// the cone solver. False where it did not reach its tolerance.
bool solve_problem(Scratch& scratch) noexcept;

/// Changes of lambda by changes of b: the first `changes` that scratch.changes.of_rows has, one after the
/// other, into scratch.changes.of_forces, which holds a guess before where contacts are many. After
/// solve_problem.
void find_force_changes(Scratch& scratch, int changes) noexcept;

/// Gives scratch.problem.lambda to the contact points, the near field and the tools' contact wrenches.
void apply_forces(State& state, const Scratch& scratch) noexcept;

/// What the contact of a tick came to.
enum class ContactOutcome : std::uint8_t {
  solved,
  unchanged,   ///< nothing has moved, and all contact points, forces and places are those of the tick before
  not_finite,  ///< StepStatus::result_not_finite: everything but the contact points stays as it was
};

/// Finds the contact points and their forces, and moves tools and near surface to where these take them. A
/// pass is a step of Newton's method: one is enough except for contact that slips far in a tick. Takes up the
/// patch that is wanted.
ContactOutcome solve_contact(const Body& body, State& state, Scratch& scratch) noexcept;

}  // namespace palpate
