// Effect of rotating normals on the derivative of the contact problem.
#pragma once

#include <Eigen/Core>

#include "runtime/core/tick/state.h"

namespace palpate {

/// Returns true if normals of a tool's closed contacts rotate with its motion. The body's response to it is
/// then computed, unless there are more contacts than HandTuning allows: the body does not respond then.
/// `radius`: radius by which the normals rotate (rolling.h) [m].
bool begin_rolling(const State& state, Scratch& scratch, Index number, double radius) noexcept;

/// Returns the change of the tool's force by its device's motion along each axis [N/m], given in
/// scratch.changes.of_rows, including the forces lambda q_t / R by which normals rotate: a fixed point whose
/// passes shrink by the ratio of the tool's depth to its radius. Computes scratch.changes.of_forces. Call
/// after begin_rolling.
Eigen::Matrix3d force_change_by_rolling(const State& state, Scratch& scratch, Index number) noexcept;

}  // namespace palpate
