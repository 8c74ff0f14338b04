// Where the points of a tool are.
#pragma once

#include "runtime/touch/tool.h"

namespace palpate {

/// The segment that a tool is all points within its radius of.
struct Core {
  Vec3 origin;
  Vec3 end;
};

/// Core of a tool at a pose. A sphere's ends coincide.
inline Core core_of(const Tool& tool, const ToolPose& pose, int dimension) noexcept {
  if (tool.length == 0.0) return {pose.position, pose.position};
  const Vec3 axis = pose.orientation * (dimension == 3 ? Vec3::UnitZ() : Vec3::UnitY());
  return {pose.position, pose.position + tool.length * axis};
}

/// How far a point of the tool moves when the device takes it from where it is to where it wants it [m]: of
/// the point at `arm` from the tool's origin.
inline Vec3 device_motion(const ToolPose& from, const ToolPose& to, const Vec3& arm) noexcept {
  return to.position - from.position + to.orientation * (from.orientation.conjugate() * arm) - arm;
}

}  // namespace palpate
