// What the turning of normals adds to the derivative of the contact problem.
#pragma once

#include "runtime/tick/state.h"

namespace palpate {

/// Gathers the compliance of the nodes that carry force. False where nothing of the tool rolls. Where there
/// are more than HandTuning::rolling_places of them none is gathered: the body then does not answer to the
/// turning.
bool begin_rolling(const State& state, Scratch& scratch, Index number) noexcept;

/// Begins a derivative by what scratch.row_change says.
void begin_derivative(const State& state, Scratch& scratch) noexcept;

/// The forces lambda q_t / R by which normals turn (rolling.h) when the tool moves by `motion`; in q the
/// surface moves by scratch.rolling_motion. Fills scratch.row_change: what they move along the rows beside
/// what the derivative began with. Returns their sum on the tool.
Vec3 turn_normals(const State& state, Scratch& scratch, Index number, const Vec3& motion,
                  double radius) noexcept;

/// Fills scratch.rolling_motion: what the last turn and scratch.force_change displace the nodes by.
void follow_forces(const State& state, Scratch& scratch) noexcept;

}  // namespace palpate
