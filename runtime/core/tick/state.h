// State of a simulation: everything that a tick changes.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/core/body/elastic_body.h"
#include "runtime/core/body/free_motion.h"
#include "runtime/core/body/near_field.h"
#include "runtime/core/solve/surface_tree.h"
#include "runtime/core/tick/local_model.h"
#include "runtime/core/tick/scratch.h"
#include "runtime/core/tick/status.h"
#include "runtime/core/touch/contact_point.h"
#include "runtime/core/touch/tool.h"

namespace palpate {

/// State of one tool.
struct ToolState {
  Tool tool;
  ToolPose device;        ///< device pose used by the tick: the last finite one, approached at bounded speed
  ToolPose pose;          ///< pose of the tool itself, outside the body: `device` plus the coupling's stretch
  Wrench contact_wrench;  ///< contacts on the tool, about its origin
  Wrench wrench;          ///< on the hand, about the tool's origin: to be displayed by the device
  LocalModel local;       ///< linearisation of wrench.force
  Wrench last_contact_wrench;          ///< contact_wrench of the last tick or pass
  Vec3 last_force = Vec3::Zero();      ///< contact_wrench.force of the last tick [N]
  Vec3 last_change = Vec3::Zero();     ///< change of contact_wrench.force in the last tick [N]
  ToolPose last_device;                ///< device pose of the last tick
  Vec3 last_motion = Vec3::Zero();     ///< motion of the device in the last tick [m]
  Vec3 surface_change = Vec3::Zero();  ///< free motion of the touched surface since the last tick [m]
  Wrench explained;                    ///< change of the contact's wrench by the device's motion in this tick
  double recent_force = 0.0;           ///< decaying maximum of the contact force [N]
  double margin = 0.0;                 ///< largest distance of surface that may be touched in this tick [m]
  Index contacts = 0;                  ///< closed contact points
  double force_error = 0.0;   ///< estimated error of contact_wrench.force if the solver was stopped early or
                              ///< contact points were left out; else 0 [N]
  double greens_error = 0.0;  ///< bound on the error of contact_wrench.force from compressed Green's
                              ///< functions (ErrorBound); 0 if they are exact [N]
  Index left_out = 0;         ///< contact points pressed by the tool beyond the capacity
  bool placed = false;        ///< has had a pose
  bool engaged = false;       ///< can touch the body
  bool has_been_clear = false;  ///< has been clear of the body; before that nothing is felt. A tool lost in
                                ///< the body later is felt again once its core is outside
  bool holding = false;         ///< a grab holds the surface
  bool touched_last_tick = false;      ///< had closed contact points
  bool held_last_tick = false;         ///< a grab held the surface
  StepStatus status = StepStatus::ok;  ///< status of the last tick
};

/// Location of a run of stored nodes (ElasticBody::runs): with near nodes, beside such a run, or far.
enum class RunPlace : std::uint8_t { far, beside, near };

/// Progress of the updates of the surface far from the tools.
struct FarSweep {
  explicit FarSweep(Index run_count)
      : near_runs(static_cast<std::size_t>(run_count)), runs(near_runs.size()) {}

  Index next_node = 0;           ///< stored node at which the sweep of the whole body continues
  Index next_patch_node = 0;     ///< place in the patch at which it continues there
  double change = 0.0;           ///< largest displacement of a node in this sweep [m]
  double last_change = 0.0;      ///< change of the previous sweep: possible error of a far node [m]
  std::vector<Index> near_runs;  ///< [ElasticBody::runs] runs that are updated more often, in order
  Index near_run_count = 0;      ///< number of these
  Index next_near_run = 0;       ///< place in near_runs at which the next tick continues
  Index done_of_run = 0;         ///< nodes of that run that are updated already
  std::vector<RunPlace> runs;    ///< [ElasticBody::runs] when near_runs was filled
};

/// Workspace of a change of the compliance.
struct ComplianceChange {
  ComplianceChange(const ElasticBody& body, Index nodes)
      : range(static_cast<std::size_t>(nodes)),
        before(static_cast<std::size_t>(body.dimension()) * range.size()),
        after(before.size()),
        of_all(static_cast<std::size_t>(body.motion_size())) {}

  std::vector<NodeRange> range;       ///< nodes that near nodes follow, one each
  std::vector<double> before, after;  ///< their displacement by the forces, d each [m]
  std::vector<double> of_all;         ///< [n + n_q] what the change takes from the displacement by forces [m]
};

/// Deformed surface, kept from tick to tick. Each member: shape, stages that change it.
struct SurfaceState {
  SurfaceTree tree;                         ///< [S] all stages that move the surface
  NearField near;                           ///< [near nodes] detection: its nodes; solution: its forces
  FreeMotion motion;                        ///< [n] follow_free_motion and release
  std::vector<double> stored_displacement;  ///< [n] by contact forces, as of their last update [m]
  FarSweep sweep;                           ///< renew_far_surface and renew_patch_surface
  double own_motion = 0.0;  ///< largest motion of a near node by the body itself in this tick [m]
  double unfollowed = 0.0;  ///< motion since follow_free_motion last moved nodes beside the near ones [m]
  ComplianceChange change;  ///< change_compliance
  std::shared_ptr<const Patch> patch;  ///< requested overlay, null for none; used from the next tick on
  bool patch_is_older = false;  ///< set by the patch source: older patch in use (StepStatus::older_patch)
  double rigid_compliance;      ///< constant: added to every contact, so that coincident points divide the
                                ///< force [m/N]
  double least_compliance;      ///< constant: least compliance of body and coupling together at a pressing
                                ///< tool [m/N]
};

struct StateOptions {
  std::vector<Tool> tools = {Tool{}};
  Index max_contacts = 256;  ///< contact points of all tools together, merged; of more, the deepest are kept
  Index patch_nodes = 0;     ///< largest number of nodes g of a patch
  double tick = 0.001;       ///< time between ticks [s]
};

/// Everything that a tick changes for one body: the tools, the surface with its contacts, and the workspace.
/// Copies are complete and independent, so that reset, record and replay are copies. All memory is allocated
/// here: copying allocates, a tick does not.
struct State {
  /// State of a body at rest without contact. Throws Error for invalid tools (a size or stiffness that is
  /// negative or not a number), no tool, or no capacity for contacts.
  explicit State(const ElasticBody& body, const StateOptions& options = {});

  /// Contact points of the last tick, with the forces of closed ones.
  [[nodiscard]] std::span<const ContactPoint> contacts() const noexcept {
    return {contact_points.data(), static_cast<std::size_t>(contact_count)};
  }
  [[nodiscard]] Index max_contacts() const noexcept { return static_cast<Index>(contact_points.size()); }

  double tick;                   ///< time between ticks [s]
  std::int64_t ticks = 0;        ///< number of ticks so far
  std::int64_t still_ticks = 0;  ///< ticks since a device, the body itself or its overlay moved or changed
  std::int64_t rest_ticks = 0;   ///< the same, but a body on two levels only moves towards its balance
  bool goes_half_way = false;    ///< the last tick made only half of its change of forces
  StepStatus status = StepStatus::ok;  ///< status of the last tick, for all tools
  std::vector<ToolState> tools;
  std::vector<ContactPoint> contact_points;  ///< [max_contacts] held ones first
  Index contact_count = 0;
  Index held_count = 0;  ///< number of held ones among contact_points
  SurfaceState surface;
  Scratch scratch;  ///< workspace passed to the stages
};

/// Position of a surface node in this tick without its contact forces [m].
inline Vec3 unloaded_position(const ElasticBody& body, SurfaceState& surface, Index surface_node) noexcept {
  return body.surface_rest_positions()[surface_node] + surface.motion.at(body, surface_node);
}

}  // namespace palpate
