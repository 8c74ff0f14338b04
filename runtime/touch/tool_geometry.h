// Where the points of a tool are.
#pragma once

#include "runtime/touch/tool.h"

namespace palpate {

/// What a tool is all points within its radius of: a segment or, with a disc_radius, a disc around `origin`.
struct Core {
  Vec3 origin;
  Vec3 end;
  double disc_radius = 0.0;      ///< [m]
  Vec3 axis = Vec3::Zero();      ///< of the disc, unit
  Vec3 diameter = Vec3::Zero();  ///< direction in the disc that turns with the tool, unit
};

/// How far from the tool's origin its core reaches [m].
inline double core_extent(const Tool& tool) noexcept {
  return tool.disc_radius > tool.radius ? tool.disc_radius - tool.radius : tool.length;
}

/// Whether a tool's core is a single point: that of a sphere.
inline bool has_point_core(const Tool& tool) noexcept {
  return core_extent(tool) == 0.0;
}

/// How far from its origin a tool reaches [m].
inline double extent(const Tool& tool) noexcept {
  return tool.radius + core_extent(tool);
}

/// Core of a tool at a pose. A sphere's ends coincide. In the plane a disc is the segment that is left of it.
inline Core core_of(const Tool& tool, const ToolPose& pose, int dimension) noexcept {
  if (tool.disc_radius > tool.radius) {
    const double radius = core_extent(tool);
    const Vec3 diameter = pose.orientation * Vec3::UnitX();
    if (dimension == 3)
      return {pose.position, pose.position, radius, pose.orientation * Vec3::UnitZ(), diameter};
    return {pose.position - radius * diameter, pose.position + radius * diameter};
  }
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
