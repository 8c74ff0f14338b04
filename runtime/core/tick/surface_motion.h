// Motion of the surface by the body's free motion and the contact forces.
#pragma once

#include <cstdint>
#include <memory>

#include "runtime/core/tick/state.h"

namespace palpate {

/// Moves the surface to where the body's free motion has it in this tick: all near nodes, and as many around
/// the tools as may have come near since they were looked at. Sets StepStatus::late_motion.
void follow_free_motion(const ElasticBody& body, State& state, DetectionScratch& detection) noexcept;

/// Switches the compliance for contact forces, null for the body's Green's functions, without moving the
/// surface. Call after FreeMotion::receive, between ticks. `shift`: MotionSample::shift, which saves finding
/// the displacement of all nodes; empty: not known.
void change_compliance(const ElasticBody& body, SurfaceState& surface,
                       const std::shared_ptr<const Greens>& compliance,
                       std::span<const double> shift = {}) noexcept;

/// Moves the near surface nodes by free motion and contact forces.
void move_near_surface(const ElasticBody& body, SurfaceState& surface) noexcept;

/// Copies the displacement of the body's nodes in the near field to surface.stored_displacement.
void renew_stored_displacement(const ElasticBody& body, SurfaceState& surface) noexcept;

/// Moves the next slice of the far surface, by u = Xi E f for as many stored nodes as the tick has time for
/// (theory.md section 3); `room` is workspace. `tick`: number of the tick. Around the near nodes the surface
/// follows within tens of ticks for hundreds of loaded nodes; one tick out of tuning.far.all_stride is for
/// the whole body.
void renew_far_surface(const ElasticBody& body, SurfaceState& surface, std::span<double> room,
                       std::int64_t tick) noexcept;

/// Moves the next slice of the overlay patch's surface; nothing if there is none.
void renew_patch_surface(const ElasticBody& body, SurfaceState& surface, std::span<double> room) noexcept;

}  // namespace palpate
