// Where the tools are: after the device, and pushed away by the contact.
#pragma once

#include "runtime/tick/state.h"

namespace palpate {

/// The device's pose for this tick: where it wants to be, but no farther from the last one than contact can
/// follow; through free space as far as it is free. A tool that has not been clear of the body, or
/// is lost in it, is placed there and not engaged.
void follow_device(const Body& body, const SurfaceTree& tree, DetectionScratch& detection, ToolState& tool,
                   ToolPose wanted) noexcept;

/// The tools to where the couplings let their contact wrenches take them.
void move_tools(const Body& body, State& state) noexcept;

}  // namespace palpate
