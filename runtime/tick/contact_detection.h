// Finds where the tools can touch the deformed surface.
#pragma once

#include "runtime/body/body.h"
#include "runtime/solve/nearest_point.h"
#include "runtime/tick/tool.h"

namespace palpate {

struct State;

/// Nearest points of a tool's core and a simplex.
struct TouchingPair {
  Index simplex = -1;
  int place = 0;  ///< on the core: 0 its origin, 1 its end, 2 between
  NearestPoint nearest;
  Vec3 normal = Vec3::Zero();  ///< of the simplex, outward, unit
  double height = 0.0;         ///< of the core's point over the simplex's plane [m]
  double distance = 0.0;       ///< [m]
};

/// The segment that a tool is all points within its radius of.
struct Core {
  Vec3 origin;
  Vec3 end;
};
Core core_of(const Tool& tool, const ToolPose& pose, int dimension) noexcept;

/// How far a point of the tool moves when the device takes it from where it is to where it wants it [m]: of
/// the point at `arm` from the tool's origin.
Vec3 device_motion(const ToolPose& from, const ToolPose& to, const Vec3& arm) noexcept;

/// Fills state.contact_points: held ones first, then for each engaged tool the nearest points of the surface
/// within the tool's margin, of each triangle (line) and core end one, of a segment and a large sphere also
/// those of corners and of a segment those of edges, without duplicates, the deepest where there are more
/// than max_contacts. A sphere of over six edges in radius touches corners alone. Nodes of all contacts are
/// in state.near.
void find_contacts(const Body& body, State& state) noexcept;

/// Whether a tool's core is outside of the body at a pose.
bool is_outside(const Body& body, State& state, const Tool& tool, const ToolPose& pose) noexcept;

/// Whether a tool is clear of the body at a pose: its core outside, nothing nearer to it than its radius.
bool is_clear(const Body& body, State& state, const Tool& tool, const ToolPose& pose) noexcept;

}  // namespace palpate
