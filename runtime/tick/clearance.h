// Whether a tool is outside of the body.
#pragma once

#include "runtime/tick/state.h"

namespace palpate {

/// Whether a tool's core is outside of the body at a pose.
bool is_outside(const Body& body, const SurfaceTree& tree, DetectionScratch& detection, const Tool& tool,
                const ToolPose& pose) noexcept;

/// Whether a tool is clear of the body at a pose: its core outside, nothing nearer to it than its radius.
bool is_clear(const Body& body, const SurfaceTree& tree, DetectionScratch& detection, const Tool& tool,
              const ToolPose& pose) noexcept;

}  // namespace palpate
