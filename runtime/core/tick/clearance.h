// Checks whether a tool is outside the body.
#pragma once

#include "runtime/core/tick/state.h"

namespace palpate {

/// True if a tool's core is outside the body at a pose.
bool is_outside(const ElasticBody& body, const SurfaceTree& tree, DetectionScratch& detection,
                const Tool& tool, const ToolPose& pose) noexcept;

/// True if a tool is clear of the body at a pose: its core is outside and no surface is within its radius.
bool is_clear(const ElasticBody& body, const SurfaceTree& tree, DetectionScratch& detection, const Tool& tool,
              const ToolPose& pose) noexcept;

}  // namespace palpate
