// Merging of contact points: neighbouring surface nodes under a large tool become one.
#pragma once

#include "runtime/core/tick/state.h"

namespace palpate {

/// True if a contact point represents neighbouring nodes that were merged.
[[nodiscard]] bool is_group(const ContactPoint& contact) noexcept;

/// Merges contact points once more than tuning.merging.from nodes carried force, or
/// scratch.detection.candidates nearly exceed the capacity: those at nodes of a group
/// (ElasticBody::aggregates) that carried force are replaced by one. Its force is distributed over the nodes
/// as theirs was, its gap is their mean with the same weights, so merging or splitting changes nothing by
/// itself. While merged, the pressure distribution inside the group is fixed; its error shows as deviations
/// of the nodes' gaps, and a group whose deviations are too large is split for a tick and merged again.
/// Nothing is merged with an overlay.
void merge_contacts(const ElasticBody& body, State& state, Scratch& scratch) noexcept;

/// Converts scratch.last.contacts to the groups of state.contact_points: forces of nodes that are now merged
/// are added up, those of former groups are distributed.
void hand_over_merged(const ElasticBody& body, const State& state, Scratch& scratch) noexcept;

}  // namespace palpate
