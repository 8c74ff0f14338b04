#include "runtime/core/tick/tool_motion.h"

#include <algorithm>
#include <cmath>

#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/tick/clearance.h"
#include "runtime/core/touch/tool_geometry.h"

namespace palpate {
namespace {

constexpr double farthest = 1e100;  // largest plausible coordinate [m]: squares of distances stay finite

/// Eigen's stableNorm is not used: its last bits depend on the alignment of a vector.
bool make_valid(ToolPose& pose, int dimension) noexcept {
  if (!(pose.position.array().abs() < farthest).all() || !pose.orientation.coeffs().allFinite()) return false;
  if (dimension == 2) {
    pose.position.z() = 0.0;
    pose.orientation.x() = 0.0;
    pose.orientation.y() = 0.0;
  }
  const double largest = pose.orientation.coeffs().cwiseAbs().maxCoeff();
  if (!(largest > 1e-6)) return false;
  pose.orientation.coeffs() /= largest;
  pose.orientation.normalize();
  return true;
}

/// Largest displacement of a tool's points from one pose to another.
double motion(const Tool& tool, const ToolPose& from, const ToolPose& to) noexcept {
  const double turned = extent(tool) > 0.0 ? from.orientation.angularDistance(to.orientation) : 0.0;
  return (to.position - from.position).norm() + turned * extent(tool);
}

ToolPose between(const ToolPose& from, const ToolPose& to, double share) noexcept {
  return {.orientation = from.orientation.slerp(share, to.orientation),
          .position = from.position + share * (to.position - from.position),
          .grab = to.grab};
}

/// True if the device is farther from the resting body than the body is large, whatever catches the tool: a
/// fold of the surface, or a soft spring behind the body.
bool has_gone_away(const ElasticBody& body, const ToolState& tool) noexcept {
  const double distance = body.bounds().exteriorDistance(tool.device.position);
  return !tool.holding && distance > extent(tool.tool) + body.bounds().diagonal().norm();
}

}  // namespace

void follow_device(const ElasticBody& body, const SurfaceState& surface, DetectionScratch& detection,
                   ToolState& tool, ToolPose wanted) noexcept {
  const SurfaceTree& tree = surface.tree;
  tool.last_motion = tool.device.position - tool.last_device.position;
  tool.last_device = tool.device;
  if (!make_valid(wanted, body.dimension())) {
    tool.status |= StepStatus::pose_not_finite;
    wanted = tool.device;
    if (!tool.placed) return;
  }
  const double size = std::max(body.mean_surface_edge(), tool.tool.radius);
  const double least = tuning.following.margin * body.mean_surface_edge();
  const auto place = [&] {
    tool.last_device = wanted;  // forces now do not come from a motion
    tool.pose = tool.device = wanted;
    tool.margin = least;
    tool.placed = true;
  };
  const bool caught = tool.contacts > 0 && has_gone_away(body, tool);
  if (!tool.placed || (!tool.engaged && !tool.holding) || caught) {
    place();
    tool.engaged = tool.has_been_clear ? is_outside(body, tree, detection, tool.tool, wanted)
                                       : is_clear(body, tree, detection, tool.tool, wanted);
    tool.has_been_clear = tool.has_been_clear || tool.engaged;
    if (!tool.engaged) tool.status |= StepStatus::inside_body;
    return;
  }

  const double wanted_motion = motion(tool.tool, tool.device, wanted);
  double most = tuning.following.most_motion * size;
  if (wanted_motion > most && tool.contacts == 0 && !tool.holding) {
    const double free = std::sqrt(tree.nearest(tool.device.position).nearest.squared_distance) -
                        tool.tool.radius - core_extent(tool.tool) - least;
    most = std::max(most, free);
    if (wanted_motion <= free) return place();
  }
  if (wanted_motion > most) {
    tool.status |= StepStatus::pose_limited;
    wanted = between(tool.device, wanted, most / wanted_motion);
  }
  tool.device = wanted;
  const bool is_free = tool.contacts == 0 && !tool.holding;  // it was at the device's position
  const double moved = is_free ? motion(tool.tool, tool.pose, tool.device) : wanted_motion;
  // Tool and surface may meet, or move apart without their contact.
  tool.margin = least + 2.0 * std::min(moved + surface.own_motion, tuning.following.most_motion * size);
}

void move_tools(const ElasticBody& body, State& state) noexcept {
  for (ToolState& tool : state.tools) {
    ToolPose pose = tool.device;
    pose.position += tool.contact_wrench.force / tool.tool.coupling_stiffness;
    const Vec3 turn = tool.contact_wrench.torque / tool.tool.coupling_torsion;
    const double angle = turn.norm();
    if (angle > 0.0) pose.orientation = Eigen::AngleAxisd(angle, turn / angle) * pose.orientation;
    const double most =
        tuning.following.most_motion * std::max(body.mean_surface_edge(), tool.tool.radius) + tool.margin;
    const double moved = motion(tool.tool, tool.pose, pose);
    tool.pose = moved > most ? between(tool.pose, pose, most / moved) : pose;
  }
}

}  // namespace palpate
