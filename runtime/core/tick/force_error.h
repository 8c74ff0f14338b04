// Estimated error of a tick's contact forces.
#pragma once

#include "runtime/core/tick/state.h"
#include "runtime/core/touch/tool_geometry.h"

namespace palpate {

/// Records a simplex of scratch.detection.found that exceeds the capacity, if the tool reaches into it.
void leave_out_simplex(const ElasticBody& body, const State& state, DetectionScratch& detection, Index tool,
                       const Core& core, Index simplex) noexcept;

/// Records a contact point that exceeds the capacity.
void leave_out_contact(const ElasticBody& body, const State& state, DetectionScratch& detection,
                       const ContactPoint& contact) noexcept;

/// Computes scratch.force_error.missing_force [tools], the immediate change of the forces of an unsolved
/// problem by one more Newton step. Call before the local models of a tick are made.
void begin_force_error(Scratch& scratch) noexcept;

/// Adds the error of the force along an axis, from the response of the forces to a motion of the tool along
/// it (scratch.changes.of_forces from `begin` on).
void note_answer(Scratch& scratch, Index tool, int axis, Index begin) noexcept;

/// Computes force_error and left_out of the tools, once surface and tools have moved. Places left out count
/// if the tool presses on them. The forces that would close each alone are scaled so that together they just
/// close the deepest: mostly an overestimate, as the present contacts would be relieved.
void find_force_errors(const ElasticBody& body, State& state, Scratch& scratch) noexcept;

}  // namespace palpate
