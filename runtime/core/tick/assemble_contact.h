// Assembly of the contact problem.
#pragma once

#include "runtime/core/tick/state.h"

namespace palpate {

/// Fills scratch.problem and scratch.rows for state.contact_points: W = J Xi J^T + what the couplings give
/// way, b the motion along the rows when the tools go to where the devices want them and the forces become
/// problem.base, and as a guess the forces of the same contacts in the tick before.
///
/// After the rows of all contacts come those of the tilt of edges and faces that carried force. Contact with
/// a straight edge or flat face under a tool of radius R is nonlinear in its slope s along the surface: the
/// gap loses R s^2 / 2. That is a spring of stiffness lambda_n R against tilting further in this tick, the
/// positive part of Newton's geometric stiffness; without it ticks overshoot and the contact buzzes. It
/// vanishes when nothing moves, so the answer is not changed.
void assemble_contact(const ElasticBody& body, State& state, Scratch& scratch, Pass pass) noexcept;

}  // namespace palpate
