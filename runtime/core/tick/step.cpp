#include "runtime/core/tick/step.h"

#include <algorithm>

#include "base/vectors.h"
#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/tick/contact_solution.h"
#include "runtime/core/tick/force_error.h"
#include "runtime/core/tick/grab.h"
#include "runtime/core/tick/hand_force.h"
#include "runtime/core/tick/linearise.h"
#include "runtime/core/tick/release.h"
#include "runtime/core/tick/surface_motion.h"
#include "runtime/core/tick/tool_motion.h"
#include "runtime/core/touch/contact_nodes.h"

namespace palpate {
namespace {

void begin_tick(State& state) noexcept {
  ++state.ticks;
  state.status = state.surface.patch_is_older ? StepStatus::older_patch : StepStatus::ok;
  for (ToolState& tool : state.tools) {
    tool.status = StepStatus::ok;
    tool.force_error = 0.0;
    tool.greens_error = 0.0;
    tool.left_out = 0;
    tool.touched_last_tick = tool.contacts > 0;
    tool.held_last_tick = tool.holding;
    tool.last_change = tool.contact_wrench.force - tool.last_force;
    tool.last_force = tool.contact_wrench.force;
  }
}

void follow_devices(const ElasticBody& body, State& state, DetectionScratch& detection,
                    std::span<const ToolPose> poses) noexcept {
  for (std::size_t k = 0; k < state.tools.size(); ++k)
    follow_device(body, state.surface, detection, state.tools[k], poses[k]);
  state.surface.near.begin_tick();
}

bool is_still(const ToolState& tool) noexcept {
  return tool.device.position == tool.last_device.position &&
         tool.device.orientation.coeffs() == tool.last_device.orientation.coeffs() &&
         tool.holding == tool.held_last_tick;
}

/// Counts the ticks in which nothing moves that could change a contact's force.
void count_still_ticks(const ElasticBody& body, State& state) noexcept {
  const bool rests = state.surface.patch == state.surface.near.patch() &&
                     std::all_of(state.tools.begin(), state.tools.end(), is_still);
  const bool is_moved = state.surface.motion.active(),
             swings = is_moved && body.contact_model() != ContactModel::two_level;
  state.still_ticks = rests && !is_moved ? state.still_ticks + 1 : 0;
  state.rest_ticks = rests && !swings ? state.rest_ticks + 1 : 0;
}

/// Sets the status of tools whose contact has not come to rest although nothing has moved for long.
void note_unsettled_tools(State& state) noexcept {
  if (static_cast<double>(state.rest_ticks) * state.tick < tuning.hand.patience) return;
  for (ToolState& tool : state.tools) {
    const Vec3& force = tool.contact_wrench.force;
    const double most = tuning.hand.settled_share * tool.recent_force;
    if ((force - tool.last_force).norm() > most) tool.status |= StepStatus::unsettled;
  }
}

/// Computes the mean free motion of the surface touched by a tool, weighted by force. That of a body on two
/// levels only corrects what the tick foresaw: no motion of the body explains its forces.
void note_surface_change(const ElasticBody& body, const State& state, ToolState& tool,
                         Index number) noexcept {
  tool.surface_change.setZero();
  if (!state.surface.motion.active() || body.contact_model() == ContactModel::two_level) return;
  double sum = 0.0;
  for (const ContactPoint& contact : state.contacts()) {
    const double force = contact.tool == number ? contact.force.norm() : 0.0;
    for_each_node(body, state.surface.near, contact, [&](Index node, double weight) {
      tool.surface_change += force * weight * state.surface.motion.change(node);
    });
    sum += force;
  }
  if (sum > 0.0) tool.surface_change /= sum;
}

void note_surface_changes(const ElasticBody& body, State& state) noexcept {
  for (std::size_t k = 0; k < state.tools.size(); ++k)
    note_surface_change(body, state, state.tools[k], static_cast<Index>(k));
}

void give_forces(State& state) noexcept {
  for (ToolState& tool : state.tools) give_force(tool, state.tick);
}

StepStatus end_tick(State& state) noexcept {
  for (const ToolState& tool : state.tools) state.status |= tool.status;
  return state.status;
}

}  // namespace

StepStatus step(const ElasticBody& body, State& state, std::span<const ToolPose> poses) noexcept {
  Scratch& scratch = state.scratch;
  begin_tick(state);
  follow_free_motion(body, state, scratch.detection);
  follow_devices(body, state, scratch.detection, poses);
  scratch.last.remember(state.contacts());
  update_holds(body, state, scratch.last);
  count_still_ticks(body, state);
  const ContactOutcome contact = solve_contact(body, state, scratch);
  if (contact == ContactOutcome::solved) {
    note_surface_changes(body, state);
    linearise(body, state, scratch);
    note_unsettled_tools(state);
  }
  if (contact != ContactOutcome::not_finite) {
    find_force_errors(body, state, scratch);
    give_forces(state);
  }
  release(body, state);
  renew_stored_displacement(body, state.surface);
  renew_far_surface(body, state.surface, scratch.far_displacement, state.ticks);
  renew_patch_surface(body, state.surface, scratch.far_displacement);
  state.surface.tree.refit();
  return end_tick(state);
}

StepStatus step(const ElasticBody& body, State& state, const ToolPose& pose) noexcept {
  return step(body, state, std::span<const ToolPose>(&pose, 1));
}

void surface_displacement(const ElasticBody& body, const State& state, std::span<double> u) noexcept {
  const SurfaceLoad& load = state.surface.near.load();
  load.greens(body).displacement(load.nodes(), load.forces(), u);
  if (!state.surface.motion.active()) return;
  const int d = body.dimension();
  for (Index node = 0; node < body.greens().nodes(); ++node)
    set_vector(u, d, node, vector_at(u, d, node) + state.surface.motion.displacement(body, node));
}

}  // namespace palpate
