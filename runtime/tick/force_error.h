// How far the contact force of a tick may be from the one that was asked for.
#pragma once

#include "runtime/tick/state.h"
#include "runtime/touch/tool_geometry.h"

namespace palpate {

/// Notes a simplex of scratch.detection.found that found no room, as far as the tool reaches into it.
void leave_out_simplex(const Body& body, const State& state, DetectionScratch& detection, Index tool,
                       const Core& core, Index simplex) noexcept;

/// Notes a contact point that found no room.
void leave_out_contact(const Body& body, const State& state, DetectionScratch& detection,
                       const ContactPoint& contact) noexcept;

/// Before the local models of a tick are made: fills scratch.force_error.missing_force [tools] with what the
/// forces of a problem that was not solved change by at once, in one more step of Newton's method.
void begin_force_error(Scratch& scratch) noexcept;

/// Takes in how the forces answer to a motion of the tool along an axis (scratch.changes.of_forces from
/// `begin` on): what the tool lacks along that axis.
void note_answer(Scratch& scratch, Index tool, int axis, Index begin) noexcept;

/// Fills force_error and left_out of the tools, once surface and tools are where the forces have them. Of
/// what found no room those places count that the tool has come to press on. The forces that would close each
/// alone are scaled so that together they just close the deepest: mostly somewhat more than what is missing,
/// as the contacts that are there would be relieved.
void find_force_errors(const Body& body, State& state, Scratch& scratch) noexcept;

}  // namespace palpate
