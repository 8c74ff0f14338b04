// Geometry of tools.
#pragma once

#include "runtime/core/touch/tool.h"

namespace palpate {

/// Core of a tool, whose points are all within its radius of it: a segment or, with a disc_radius, a disc
/// around `origin`.
struct Core {
  Vec3 origin;
  Vec3 end;
  double disc_radius = 0.0;      ///< [m]
  Vec3 axis = Vec3::Zero();      ///< axis of the disc, unit vector
  Vec3 diameter = Vec3::Zero();  ///< direction in the disc that rotates with the tool, unit vector
};

/// Distance from the tool's origin to the farthest point of its core [m].
inline double core_extent(const Tool& tool) noexcept {
  return tool.disc_radius > tool.radius ? tool.disc_radius - tool.radius : tool.length;
}

/// True if a tool's core is a single point, as that of a sphere.
inline bool has_point_core(const Tool& tool) noexcept {
  return core_extent(tool) == 0.0;
}

/// True for spheres, and for capsules that are no longer than two radii: 256 contact points are enough for
/// these on a surface with a node every fifth of the radius.
inline bool is_compact(const Tool& tool) noexcept {
  return tool.disc_radius <= tool.radius && tool.length <= 2.0 * tool.radius;
}

/// Distance from its origin to the farthest point of a tool [m].
inline double extent(const Tool& tool) noexcept {
  return tool.radius + core_extent(tool);
}

/// Returns the core of a tool at a pose. A sphere's ends coincide. In the plane a disc becomes a segment.
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

/// Displacement [m] of the tool's point at `arm` from its origin, when the device moves the tool from `from`
/// to `to`.
inline Vec3 device_motion(const ToolPose& from, const ToolPose& to, const Vec3& arm) noexcept {
  return to.position - from.position + to.orientation * (from.orientation.conjugate() * arm) - arm;
}

}  // namespace palpate
