// Tick of a recording, as far as the step computes it.
#pragma once

#include "formats/recording.h"
#include "runtime/body/body.h"
#include "runtime/core/tick/state.h"

namespace palpate {

void set(double (&vector)[3], const Vec3& value) noexcept;
/// Stores w, x, y, z.
void set(double (&wxyz)[4], const Eigen::Quaterniond& value) noexcept;
/// Stores xx, yy, zz, xy, yz, zx.
void set(double (&symmetric)[6], const Eigen::Matrix3d& value) noexcept;

/// Writes the results of `tool` in the last tick to `record`. `wanted` is the pose requested by the device;
/// `centre` is the stored node of its overlay, -1 for none. Real-time safe.
void record_tool(TickRecord& record, const Body& body, const State& state, const ToolState& tool,
                 const ToolPose& wanted, Index centre) noexcept;

}  // namespace palpate
