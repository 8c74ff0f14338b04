// The rows of the contact problem.
#pragma once

#include "runtime/core/tick/state.h"

namespace palpate {

/// Appends state.contact_points to scratch.problem, with their rows in scratch.rows: b is what tool and
/// surface move against each other if no force changes, and the gap; lambda the force of the same contact in
/// the tick before. Where W is kept from tick to tick the contact points are brought into the order of the
/// tick before, and those that stay open are left without rows. `edge`: the surface's mean edge [m].
void add_contacts(const ElasticBody& body, State& state, Scratch& scratch, double edge, Pass pass) noexcept;

/// Appends the rows of the tilt of edges and faces that carried force (assemble_contact).
void add_tilts(const ElasticBody& body, const State& state, Scratch& scratch, double edge) noexcept;

}  // namespace palpate
