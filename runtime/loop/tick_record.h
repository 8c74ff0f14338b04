// What a recording keeps of a tick, as far as the step computes it.
#pragma once

#include "formats/recording.h"
#include "runtime/body/body.h"
#include "runtime/tick/state.h"

namespace palpate {

void set(double (&vector)[3], const Vec3& value) noexcept;
/// w, x, y, z.
void set(double (&wxyz)[4], const Eigen::Quaterniond& value) noexcept;
/// xx, yy, zz, xy, yz, zx.
void set(double (&symmetric)[6], const Eigen::Matrix3d& value) noexcept;

/// Fills in what `tool` of `state` did in the last tick, in which the device wanted it at `wanted`; `centre`
/// is the stored node of its overlay, -1 for none. Real-time safe.
void record_tool(TickRecord& record, const Body& body, const State& state, const ToolState& tool,
                 const ToolPose& wanted, Index centre) noexcept;

}  // namespace palpate
