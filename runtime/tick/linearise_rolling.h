// What the turning of normals adds to the derivative of the contact problem.
#pragma once

#include <Eigen/Core>

#include "runtime/tick/state.h"

namespace palpate {

/// Whether normals of a tool's closed contacts turn with it. Then it has gathered what the body moves by
/// that, unless contacts are more than HandTuning has room for: the body then does not answer to the turning.
/// `radius`: by which they turn (rolling.h) [m].
bool begin_rolling(const State& state, Scratch& scratch, Index number, double radius) noexcept;

/// Change of the tool's force by its device's motion along each axis [N/m], for which scratch.changes.of_rows
/// stands, with the forces lambda q_t / R by which normals turn: a fixed point, of which each pass is as much
/// smaller as the tool is deep. Fills scratch.changes.of_forces. After begin_rolling.
Eigen::Matrix3d force_change_by_rolling(const State& state, Scratch& scratch, Index number) noexcept;

}  // namespace palpate
