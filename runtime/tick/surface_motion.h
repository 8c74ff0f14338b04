// The surface that the tools meet: where the body's free motion and the contact forces take it.
#pragma once

#include <cstdint>
#include <memory>

#include "runtime/tick/state.h"

namespace palpate {

/// Moves the surface to where the body's free motion has it in this tick: all near nodes, and as many around
/// the tools as may have come near since they were looked at. Sets StepStatus::late_motion and
/// near_step_limit.
void follow_free_motion(const Body& body, State& state, DetectionScratch& detection) noexcept;

/// Lets contact forces act by another compliance, null for the body's Green's functions: where they have the
/// surface now it stays. After FreeMotion::receive, between ticks.
void change_compliance(const Body& body, SurfaceState& surface,
                       const std::shared_ptr<const Greens>& compliance) noexcept;

/// Moves the near surface nodes to where free motion and contact forces have them.
void move_near_surface(const Body& body, SurfaceState& surface) noexcept;

/// Writes what the near field knows of the body's nodes into surface.stored_displacement.
void renew_stored_displacement(const Body& body, SurfaceState& surface) noexcept;

/// Moves the next slice of the far surface, by u = Xi E f of as many stored nodes as the tick has time for
/// (theory.md section 3), put into `room` on the way. `tick`: its number. Around the near nodes the surface
/// follows within tens of ticks where hundreds of nodes are loaded; for the whole body one tick out of
/// tuning.far.all_stride is left.
void renew_far_surface(const Body& body, SurfaceState& surface, std::span<double> room,
                       std::int64_t tick) noexcept;

/// Moves the next slice of the overlay patch's surface; nothing where there is none.
void renew_patch_surface(const Body& body, SurfaceState& surface, std::span<double> room) noexcept;

}  // namespace palpate
