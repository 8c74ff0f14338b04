// Everything that a tick changes.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/body/body.h"
#include "runtime/body/free_motion.h"
#include "runtime/body/near_field.h"
#include "runtime/solve/active_set.h"
#include "runtime/solve/cone_solver.h"
#include "runtime/solve/contact_problem.h"
#include "runtime/solve/surface_tree.h"
#include "runtime/tick/assemble_contact.h"
#include "runtime/tick/contact_detection.h"
#include "runtime/tick/contact_point.h"
#include "runtime/tick/local_model.h"
#include "runtime/tick/status.h"
#include "runtime/tick/tool.h"

namespace palpate {

/// One tool.
struct ToolState {
  ToolPose
      pose;  ///< of the tool itself, which the body keeps outside; of the device: with the coupling's stretch
  ToolPose device;  ///< the device pose that the tick used: the last finite one, approached at bounded speed
  Tool tool;
  Wrench contact_wrench;       ///< of the contacts on the tool, about its origin
  Wrench wrench;               ///< on the hand, about the tool's origin: what the device is to display
  LocalModel local;            ///< of wrench.force
  Wrench last_contact_wrench;  ///< of the tick or pass before
  Vec3 last_device_position = Vec3::Zero();  ///< of the tick before [m]
  Vec3 surface_change = Vec3::Zero();        ///< free motion of what it touches, since the tick before [m]
  double felt = 0.0;                         ///< the force of late [N]
  double margin = 0.0;   ///< how far the surface may be from the tool and still be met in this tick [m]
  Index contacts = 0;    ///< closed contact points
  bool placed = false;   ///< has had a pose
  bool engaged = false;  ///< can touch
  bool has_been_clear = false;  ///< of the body once: nothing is felt before; one that is lost in the body
                                ///< after that is felt again as soon as its core is outside
  bool holding = false;         ///< a grab holds the surface
  bool touched = false;         ///< in the tick before
  bool held = false;            ///< a grab, in the tick before
  StepStatus status = StepStatus::ok;  ///< of the last tick
};

struct StateOptions {
  std::vector<Tool> tools = {Tool{}};
  Index max_contacts = 32;  ///< contact points of all tools together; beyond, the deepest are kept
  Index patch_nodes = 0;    ///< most nodes g of a patch that is to be used
  double tick = 0.001;      ///< time from one tick to the next [s]
};

/// Everything that a tick changes on one body. Copies are complete and independent, so that reset, record and
/// replay are copies. All memory is taken here: copying allocates, a tick does not.
struct State {
  static constexpr Index most_far_nodes = 64;       ///< of the body, whose far displacement a tick renews
  static constexpr Index most_far_patch_nodes = 8;  ///< and of the patch's surface

  /// The state of a body at rest that no tool touches. Throws Error for tools without sense (a size or
  /// stiffness that is negative or not a number), none, or no room for contacts.
  explicit State(const Body& body, const StateOptions& options = {});

  /// Contact points of the last tick, closed ones with their force.
  [[nodiscard]] std::span<const ContactPoint> contacts() const noexcept {
    return {contact_points.data(), static_cast<std::size_t>(contact_count)};
  }

  std::vector<ToolState> tools;
  std::vector<ContactPoint> contact_points;  ///< [max_contacts] held ones first
  Index contact_count = 0;
  Index held_count = 0;  ///< of contact_points, by grabs
  Index max_contacts;
  double tick;                         ///< time from one tick to the next [s]
  bool is_first_pass = true;           ///< of the tick's Newton steps
  StepStatus status = StepStatus::ok;  ///< of the last tick, all tools
  std::int64_t ticks = 0;              ///< taken so far

  /// The overlay that ticks are to use; null: none. A change comes with the next tick.
  std::shared_ptr<const Patch> patch;
  bool patch_is_older = false;  ///< than what is wanted: to be told in the status

  NearField near;
  FreeMotion motion;
  SurfaceTree tree;
  ContactProblem problem;
  ActiveSet active_set;
  ConeSolver cone_solver;
  std::vector<ContactRow> rows;      ///< [problem.rows]
  std::vector<double> row_response;  // [d near nodes] displacement by one row's force
  double rigid_compliance;  ///< added to what all contacts give way by: points that coincide share the force
                            ///< [m/N]
  double least_compliance;  ///< what body and coupling together give way by at least where a tool presses: a
                            ///< hundredth of what the stiffest node of the surface does [m/N]

  // Scratch of a tick.
  std::size_t most_simplices;            // that a tool may look at
  std::vector<Index> found;              // [F] simplices near a tool
  std::vector<double> found_distance;    // [F]
  std::vector<TouchingPair> pairs;       // [most_simplices]
  std::vector<ContactPoint> candidates;  // before the deepest are chosen
  Index candidate_count = 0;
  std::vector<ContactPoint> last_contacts;  // [max_contacts] of the tick before
  Index last_count = 0;
  std::vector<double> row_change;           // [rows] for the local model
  std::vector<double> force_change;         // [rows]
  std::vector<double> far_displacement;     // [d * slice]
  Index next_far_node = 0;                  // stored node from which the far field is renewed next
  std::vector<double> stored_displacement;  // [n] as it was renewed last
  double sweep_change = 0.0;                // how far a far node was moved at most in this sweep [m]
  double far_change = 0.0;                  // and in the one before: how wrong a far node can be [m]
  Index next_patch_node = 0;                // place in the patch from which its surface is renewed next
};

/// Where a surface node is in this tick without the forces of its contacts [m].
inline Vec3 unloaded_position(const Body& body, State& state, Index surface_node) noexcept {
  return body.surface_rest_positions()[static_cast<std::size_t>(surface_node)] +
         state.motion.at(body, surface_node);
}

/// Outward unit normal of a simplex of the surface as it is now.
Vec3 outward_normal(const Body& body, const State& state, Index simplex) noexcept;

}  // namespace palpate
