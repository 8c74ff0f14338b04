// Assembly of the contact problem.
#pragma once

#include "runtime/core/tick/state.h"

namespace palpate {

/// Computes scratch.problem and scratch.rows from state.contact_points: W = J Xi J^T + compliance of the
/// couplings; b is the motion along the rows when the tools move to the requested poses and the body to rest;
/// the guess consists of the forces of the same contacts in the last tick.
///
/// The rows of all contacts are followed by those for the tilt of edges and faces that carried force. Contact
/// with a straight edge or flat face under a tool of radius R is nonlinear in its slope s along the surface:
/// the gap decreases by R s^2 / 2. That is a spring of stiffness lambda_n R against further tilt in this
/// tick, the positive part of Newton's geometric stiffness; without it ticks overshoot and the contact
/// chatters. It vanishes if nothing moves, so the solution is unaffected.
void assemble_contact(const ElasticBody& body, State& state, Scratch& scratch) noexcept;

}  // namespace palpate
