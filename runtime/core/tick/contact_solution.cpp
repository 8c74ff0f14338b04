#include "runtime/core/tick/contact_solution.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/tick/assemble_contact.h"
#include "runtime/core/tick/contact_detection.h"
#include "runtime/core/tick/contact_merging.h"
#include "runtime/core/tick/release.h"
#include "runtime/core/tick/surface_motion.h"
#include "runtime/core/tick/tool_motion.h"

namespace palpate {
namespace {

constexpr double max_plausible_force = 1e100;

bool is_finite(const ContactProblem& problem) noexcept {
  return std::all_of(problem.lambda.begin(), problem.lambda.begin() + problem.rows,
                     [](double value) { return std::abs(value) < max_plausible_force; });
}

/// Scales the last change of forces by `share`.
void retreat(State& state, double share) noexcept {
  state.surface.near.retreat(share);
  state.surface.near.displace();
  for (ToolState& tool : state.tools) {
    const Wrench& last = tool.last_contact_wrench;
    tool.contact_wrench.force = last.force + share * (tool.contact_wrench.force - last.force);
    tool.contact_wrench.torque = last.torque + share * (tool.contact_wrench.torque - last.torque);
  }
}

/// A point that slides over the edge of a fold throws the surface from one side to the other, and back in the
/// next tick. If forces would move the near surface farther than a Newton step can be trusted, their change
/// is scaled down. Not for a released body, which does not leap: it keeps its position and vibrates from
/// there.
void retreat_from_leaps(const ElasticBody& body, State& state) noexcept {
  if (state.surface.near.load().count == 0 || is_released(body, state)) return;
  double farthest = 0.0;
  for (Index place = 0; place < state.surface.near.count(); ++place) {
    const Index node = state.surface.near.node(place);
    if (body.aggregate_of(node) >= 0) continue;
    const Vec3 to = unloaded_position(body, state.surface, node) + state.surface.near.displacement(place);
    farthest = std::max(farthest, (to - state.surface.tree.position(node)).norm());
  }
  double most = tuning.passes.most_motion * body.mean_surface_edge();
  for (const ToolState& tool : state.tools) most += tool.margin;
  if (farthest > most) retreat(state, most / farthest);
}

/// Newton's method may move a contact back and forth between a face and the face beyond its edge, as it
/// follows one at a time. While nothing else moves, its change is halved when it reverses. Not if contacts
/// are left out: the state half way would belong to neither set.
void halve_return(const ElasticBody& body, State& state, const DetectionScratch& detection) noexcept {
  const bool returns = state.still_ticks > 1 && detection.left_out_count == 0 && !is_released(body, state) &&
                       std::any_of(state.tools.begin(), state.tools.end(), [](const ToolState& tool) {
                         return (tool.contact_wrench.force - tool.last_force).dot(tool.last_change) < 0.0;
                       });
  state.goes_half_way = returns;
  if (returns) retreat(state, 0.5);
}

/// Largest penetration at the contact points after the last tick or pass [m].
double penetration(const State& state) noexcept {
  double deepest = 0.0;
  for (const ContactPoint& contact : state.contacts()) {
    if (!contact.held) deepest = std::max(deepest, -contact.gap);
  }
  return deepest;
}

/// True if contact points are so deep that another pass is needed. If some are merged, the gaps of those
/// being split are accurate up to the error of merging, and no pass improves them.
bool is_rough(const ElasticBody& body, const State& state) noexcept {
  const std::span<const ContactPoint> contacts = state.contacts();
  const bool some_merged = std::any_of(contacts.begin(), contacts.end(), is_group);
  const double most = some_merged ? tuning.merging.defect : tuning.passes.penetration;
  return penetration(state) > most * body.mean_surface_edge();
}

/// True if there is time for another pass, and the body is not released, after which it vibrates.
bool may_repeat(const ElasticBody& body, const State& state, const Scratch& scratch) noexcept {
  return scratch.solver.was_easy() && state.surface.near.added_blocks() <= tuning.passes.most_blocks &&
         !is_released(body, state);
}

/// Switches to the requested patch. The old one is kept if the capacity is exceeded.
void change_patch(const ElasticBody& body, State& state) noexcept {
  if (state.surface.patch == state.surface.near.patch() ||
      state.surface.near.change_patch(body, state.surface.patch))
    return;
  state.surface.patch = state.surface.near.patch();
  state.status |= StepStatus::capacity_full;
}

/// True if an iterative solver changed no force of the last tick significantly.
bool changes_nothing(const Scratch& scratch) noexcept {
  const ContactProblem& problem = scratch.problem;
  if (scratch.solver.rounding() == 0.0 || scratch.merging.has_changed) return false;
  double largest = 0.0;
  double all = 0.0;
  for (Index k = 0; k < scratch.last.count; ++k) {
    const double squared = scratch.last.contacts[k].force.squaredNorm();
    largest = std::max(largest, squared);
    all += squared;
  }
  const double most = scratch.solver.rounding() * std::sqrt(largest);
  for (Index i = 0; i < problem.rows; ++i) {
    if (std::abs(problem.lambda[i] - problem.guess[i]) > most) return false;
    all -= problem.guess[i] * problem.guess[i];
  }
  return all <= most * std::sqrt(largest);  // no contact with a force has vanished
}

/// Reports contacts that press on a rigid part of the body.
void tell_rigid_contacts(State& state) noexcept {
  for (const ContactPoint& contact : state.contacts()) {
    if (contact.rigid && !contact.force.isZero(0.0))
      state.tools[contact.tool].status |= StepStatus::rigid_contact;
  }
}

/// Restores the contacts for which the problem was solved.
void recall_contacts(State& state, const LastContacts& remembered) noexcept {
  std::copy_n(remembered.contacts.begin(), remembered.count, state.contact_points.begin());
  state.contact_count = remembered.count;
}

/// Performs one Newton step at the present positions.
ContactOutcome solve_pass(const ElasticBody& body, State& state, Scratch& scratch, Pass pass) noexcept {
  assemble_contact(body, state, scratch, pass);
  scratch.is_solved = scratch.solver.solve(scratch.problem);
  if (!scratch.is_solved) state.status |= StepStatus::not_converged;
  if (!is_finite(scratch.problem)) {
    state.status |= StepStatus::result_not_finite;
    return ContactOutcome::not_finite;
  }
  if (scratch.is_solved && pass == Pass::first && state.still_ticks > 1 && !state.goes_half_way &&
      changes_nothing(scratch)) {
    recall_contacts(state, scratch.last);
    tell_rigid_contacts(state);
    return ContactOutcome::unchanged;
  }
  apply_forces(state, scratch);
  retreat_from_leaps(body, state);
  if (pass == Pass::first) halve_return(body, state, scratch.detection);
  move_tools(body, state);
  move_near_surface(body, state.surface);
  return ContactOutcome::solved;
}

/// Slip of a sticking contact due to the solver's tolerance.
Vec3 carried_slip(const Scratch& scratch, Index k) noexcept {
  const ContactProblem& problem = scratch.problem;
  const std::span<const float> left = scratch.solver.left_motion();
  if (left.empty() || problem.held[k] != 0 || problem.rows_of(k) < 2) return Vec3::Zero();
  const Vec3& n = problem.normal[k];
  Vec3 force = Vec3::Zero();
  Vec3 motion = Vec3::Zero();
  for (Index i = 0; i < problem.rows_of(k); ++i) {
    force[i] = problem.lambda[problem.first_row(k) + i];
    motion[i] = left[problem.first_row(k) + i];
  }
  const double normal = n.dot(force);
  const double bound = problem.friction[k] * normal * (1.0 - tuning.many.slipping);
  if (normal <= 0.0 || (force - normal * n).norm() >= bound) return Vec3::Zero();
  return motion - n.dot(motion) * n;
}

void give_contact_force(const Scratch& scratch, Index number, ContactPoint& contact) noexcept {
  const auto first = static_cast<std::size_t>(scratch.problem.first_row(number));
  contact.force.setZero();
  for (Index i = 0; i < scratch.problem.rows_of(number); ++i)
    contact.force +=
        scratch.problem.lambda[first + static_cast<std::size_t>(i)] * scratch.rows[first + i].force;
  contact.carry = carried_slip(scratch, number);
}

/// Rotates the forces of rolling contacts as their faces and edges tilt.
void add_tilt_forces(State& state, const Scratch& scratch) noexcept {
  const ContactProblem& problem = scratch.problem;
  for (Index k = state.contact_count; k < problem.contacts; ++k) {
    ContactPoint& contact = state.contact_points[problem.owner[k]];
    const Index row = problem.first_row(k);
    if (contact.rolls && problem.normal_part(problem.owner[k], problem.lambda) > 0.0)
      contact.force += problem.lambda[row] * scratch.rows[row].force;
  }
}

}  // namespace

void apply_forces(State& state, const Scratch& scratch) noexcept {
  state.surface.near.unload();
  for (ToolState& tool : state.tools) {
    tool.last_contact_wrench = tool.contact_wrench;
    tool.contact_wrench = {};
    tool.contacts = 0;
  }
  for (Index i = 0; i < scratch.problem.rows; ++i) {
    const ContactRow& row = scratch.rows[i];
    const double lambda = scratch.problem.lambda[i];
    if (lambda == 0.0) continue;
    for (std::size_t n = 0; n < 3; ++n) {
      if (row.places[n] >= 0) state.surface.near.load(row.places[n], -lambda * row.body[n]);
    }
  }
  state.surface.near.displace();
  for (Index k = 0; k < state.contact_count; ++k) give_contact_force(scratch, k, state.contact_points[k]);
  add_tilt_forces(state, scratch);
  for (Index k = 0; k < state.contact_count; ++k) {
    const ContactPoint& contact = state.contact_points[k];
    if (contact.force.squaredNorm() == 0.0) continue;
    ToolState& tool = state.tools[contact.tool];
    ++tool.contacts;
    tool.contact_wrench.force += contact.force;
    if (!contact.rolls) tool.contact_wrench.torque += contact.arm.cross(contact.force);
  }
  tell_rigid_contacts(state);
}

ContactOutcome solve_contact(const ElasticBody& body, State& state, Scratch& scratch) noexcept {
  scratch.problem.moves = state.still_ticks == 0;
  const bool is_deep = body.contact_model() == ContactModel::two_level;
  scratch.problem.precision = is_deep ? tuning.many.deep_precision : 1.0;
  find_contacts(body, state, scratch, Pass::first);
  change_patch(body, state);
  bool rough = is_rough(body, state);
  ContactOutcome outcome = solve_pass(body, state, scratch, Pass::first);
  for (int pass = 1; rough && pass < tuning.passes.most; ++pass) {
    if (outcome != ContactOutcome::solved || !may_repeat(body, state, scratch)) break;
    scratch.last.remember(state.contacts());
    find_contacts(body, state, scratch, Pass::repeated);
    rough = is_rough(body, state);
    if (rough) {
      outcome = solve_pass(body, state, scratch, Pass::repeated);
    } else {
      recall_contacts(state, scratch.last);
    }
  }
  return outcome;
}

}  // namespace palpate
