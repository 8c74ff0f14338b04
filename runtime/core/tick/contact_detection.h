// Detection of contact points between the tools and the deformed surface.
#pragma once

#include "runtime/core/tick/state.h"

namespace palpate {

/// Fills state.contact_points: held ones first, then for each engaged tool the nearest points of the surface
/// within the tool's margin, one per triangle (line) and core end; for a segment, disc and large sphere also
/// corners, for a segment and disc also edges, for a disc also points of its rim; without duplicates. Many
/// are merged (contact_merging.h), and if there are still more than max_contacts, the deepest are kept. A
/// sphere with a radius of over three edges touches corners only. The nodes of all contacts are in
/// state.surface.near.
void find_contacts(const ElasticBody& body, State& state, Scratch& scratch, Pass pass) noexcept;

}  // namespace palpate
