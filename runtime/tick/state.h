// Everything that a tick changes.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/body/body.h"
#include "runtime/body/free_motion.h"
#include "runtime/body/near_field.h"
#include "runtime/solve/surface_tree.h"
#include "runtime/tick/local_model.h"
#include "runtime/tick/scratch.h"
#include "runtime/tick/status.h"
#include "runtime/touch/contact_point.h"
#include "runtime/touch/tool.h"

namespace palpate {

/// One tool.
struct ToolState {
  Tool tool;
  ToolPose device;  ///< the device pose that the tick used: the last finite one, approached at bounded speed
  ToolPose pose;    ///< of the tool itself, outside of the body: away from `device` by the coupling's stretch
  Wrench contact_wrench;            ///< of the contacts on the tool, about its origin
  Wrench wrench;                    ///< on the hand, about the tool's origin: what the device is to display
  LocalModel local;                 ///< of wrench.force
  Wrench last_contact_wrench;       ///< of the tick or pass before
  Vec3 last_force = Vec3::Zero();   ///< contact_wrench.force of the tick before [N]
  Vec3 last_change = Vec3::Zero();  ///< of contact_wrench.force in the tick before [N]
  ToolPose last_device;             ///< the device pose of the tick before
  Vec3 last_motion = Vec3::Zero();  ///< of the device in the tick before [m]
  Vec3 surface_change = Vec3::Zero();  ///< free motion of the touched surface since the tick before [m]
  Wrench explained;           ///< what the device's motion in this tick changes of the contact's wrench
  double recent_force = 0.0;  ///< running maximum of the contact force, which fades [N]
  double margin = 0.0;        ///< how far the surface may be from the tool and still be met in this tick [m]
  Index contacts = 0;         ///< closed contact points
  double force_error = 0.0;   ///< how far contact_wrench.force may be from what it is to be, where the solver
                              ///< was cut short or contact points were left out; else 0 [N]
  double greens_error = 0.0;  ///< what contact_wrench.force may be off by as compressed Green's functions are
                              ///< not exact, at most (ErrorBound); 0 where they are [N]
  Index left_out = 0;         ///< contact points that the tool presses on and that found no room
  bool placed = false;        ///< has had a pose
  bool engaged = false;       ///< can touch
  bool has_been_clear = false;  ///< of the body once: nothing is felt before; a tool that is lost in the body
                                ///< after that is felt again as soon as its core is outside
  bool holding = false;         ///< a grab holds the surface
  bool touched_last_tick = false;      ///< had closed contact points
  bool held_last_tick = false;         ///< a grab held the surface
  StepStatus status = StepStatus::ok;  ///< of the last tick
};

/// Where a run of stored nodes (Body::runs) lies: with near nodes, beside such a run, or far.
enum class RunPlace : std::uint8_t { far, beside, near };

/// The slices in which ticks renew the surface far from the tools.
struct FarSweep {
  explicit FarSweep(Index run_count)
      : near_runs(static_cast<std::size_t>(run_count)), runs(near_runs.size()) {}

  Index next_node = 0;           ///< stored node from which the sweep of the whole body goes on
  Index next_patch_node = 0;     ///< place in the patch from which it goes on there
  double change = 0.0;           ///< how far a node was moved at most in this sweep [m]
  double last_change = 0.0;      ///< and in the one before: how wrong a far node can be [m]
  std::vector<Index> near_runs;  ///< [Body::runs] those that are renewed more often, in their order
  Index near_run_count = 0;      ///< how many of them
  Index next_near_run = 0;       ///< place in near_runs from which the next tick goes on,
  Index done_of_run = 0;         ///< and nodes of it that are renewed already
  std::vector<RunPlace> runs;    ///< [Body::runs] when near_runs was filled
};

/// The deformed surface, as it goes from tick to tick. Each member: shape, who changes it.
struct SurfaceState {
  SurfaceTree tree;                         ///< [S] every stage that moves the surface
  NearField near;                           ///< [near nodes] detection: its nodes; solution: its forces
  FreeMotion motion;                        ///< [n] follow_free_motion and release
  std::vector<double> stored_displacement;  ///< [n] by contact forces, as renewed last [m]
  FarSweep sweep;                           ///< renew_far_surface and renew_patch_surface
  std::shared_ptr<const Patch> patch;       ///< the overlay wanted, null for none; the next tick takes it up
  bool patch_is_older = false;  ///< whoever sets `patch`: it is not the one wanted, as the status then tells
  double rigid_compliance;      ///< fixed: added to every contact, so that points that coincide share the
                                ///< force [m/N]
  double least_compliance;      ///< fixed: what body and coupling together give way by at least where a tool
                                ///< presses [m/N]
};

struct StateOptions {
  std::vector<Tool> tools = {Tool{}};
  Index max_contacts = 256;  ///< contact points of all tools together, merged; beyond, the deepest are kept
  Index patch_nodes = 0;     ///< most nodes g of a patch that is to be used
  double tick = 0.001;       ///< time from one tick to the next [s]
};

/// Everything that a tick changes on one body: the tools, the surface with its contacts, and the tick's
/// workspace. Copies are complete and independent, so that reset, record and replay are copies. All memory is
/// taken here: copying allocates, a tick does not.
struct State {
  /// The state of a body at rest that no tool touches. Throws Error for tools without sense (a size or
  /// stiffness that is negative or not a number), none, or no room for contacts.
  explicit State(const Body& body, const StateOptions& options = {});

  /// Contact points of the last tick, closed ones with their force.
  [[nodiscard]] std::span<const ContactPoint> contacts() const noexcept {
    return {contact_points.data(), static_cast<std::size_t>(contact_count)};
  }
  [[nodiscard]] Index max_contacts() const noexcept { return static_cast<Index>(contact_points.size()); }

  double tick;                   ///< time from one tick to the next [s]
  std::int64_t ticks = 0;        ///< taken so far
  std::int64_t still_ticks = 0;  ///< since a device, the body itself or its overlay has moved or changed
  bool goes_half_way = false;    ///< the last tick made half the change of forces that it found
  StepStatus status = StepStatus::ok;  ///< of the last tick, all tools
  std::vector<ToolState> tools;
  std::vector<ContactPoint> contact_points;  ///< [max_contacts] held ones first
  Index contact_count = 0;
  Index held_count = 0;  ///< of contact_points, by grabs
  SurfaceState surface;
  Scratch scratch;  ///< handed to the stages that use it
};

/// Where a surface node is in this tick without the forces of its contacts [m].
inline Vec3 unloaded_position(const Body& body, SurfaceState& surface, Index surface_node) noexcept {
  return body.surface_rest_positions()[surface_node] + surface.motion.at(body, surface_node);
}

}  // namespace palpate
