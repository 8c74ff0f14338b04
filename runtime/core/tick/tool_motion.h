// Motion of the tools: with the device, and away from the contact.
#pragma once

#include "runtime/core/tick/state.h"

namespace palpate {

/// Sets the device's pose for this tick: the requested one, but no farther from the last one than contact can
/// follow, or in free space as far as it is free. A tool that has not been clear of the body, or is lost in
/// it, is placed there without being engaged.
void follow_device(const ElasticBody& body, const SurfaceState& surface, DetectionScratch& detection,
                   ToolState& tool, ToolPose wanted) noexcept;

/// Moves the tools to where the couplings hold them under their contact wrenches.
void move_tools(const ElasticBody& body, State& state) noexcept;

}  // namespace palpate
