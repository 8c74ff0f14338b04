// Many contact points as fewer: neighbouring surface nodes under a large tool become one.
#pragma once

#include "runtime/tick/state.h"

namespace palpate {

/// Whether a contact point stands for neighbouring nodes that were merged.
[[nodiscard]] bool is_group(const ContactPoint& contact) noexcept;

/// Where more nodes than tuning.merging.from carried force, or scratch.detection.candidates are nearly as
/// many as there is room for, replaces those at nodes of a group (Body::aggregates) that carried force by
/// one. Its force is spread over the nodes as theirs was, its gap is their mean by the same weights: so
/// nothing changes when nodes are merged or parted. While they are merged the shape of the pressure within
/// the group stays; it is wrong by as much as the gaps of the nodes differ, and a group where they differ too
/// much is parted for a tick and merged anew. None where an overlay is.
void merge_contacts(const Body& body, State& state, Scratch& scratch) noexcept;

/// Makes of scratch.last.contacts what would have been there with the groups that state.contact_points have:
/// forces of nodes that are merged now are added, those of groups that are not any more are shared out.
void hand_over_merged(const Body& body, const State& state, Scratch& scratch) noexcept;

}  // namespace palpate
