// Finds where the tools can touch the deformed surface.
#pragma once

#include "runtime/tick/state.h"

namespace palpate {

/// Fills state.contact_points: held ones first, then for each engaged tool the nearest points of the surface
/// within the tool's margin, of each triangle (line) and core end one, of a segment, disc and large sphere
/// also those of corners, of a segment and a disc those of edges and of a disc those of its rim, without
/// duplicates; merged where they are many (contact_merging.h), and the deepest where there are more than
/// max_contacts all the same. A sphere of over three edges in radius touches corners alone. Nodes of all
/// contacts are in state.surface.near.
void find_contacts(const Body& body, State& state, Scratch& scratch) noexcept;

}  // namespace palpate
