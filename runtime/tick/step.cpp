#include "runtime/tick/step.h"

#include <algorithm>
#include <cmath>

#include "runtime/solve/node_vectors.h"
#include "runtime/tick/assemble_contact.h"
#include "runtime/tick/contact_detection.h"
#include "runtime/tick/grab.h"
#include "runtime/tick/hand_force.h"
#include "runtime/tick/local_model.h"
#include "runtime/tick/tool_motion.h"

namespace palpate {
namespace {

constexpr Index far_blocks = 512;            // pairs of loaded and renewed nodes a tick
constexpr Index most_far_moves = 64;         // surface nodes that are moved with them
constexpr double rough_penetration = 0.002;  // of the mean edge: more calls for another pass
constexpr int most_passes = 3;
constexpr double most_motion =
    0.25;  // of the mean edge and what the tools may move: of the surface in a pass
constexpr double largest_number = 1e100;  // that is a force

bool is_finite(const ContactProblem& problem) noexcept {
  return std::all_of(problem.lambda.begin(), problem.lambda.begin() + problem.rows,
                     [](double value) { return std::abs(value) < largest_number; });
}

/// Forces to the contacts, the near field and the tools.
void apply_forces(State& state) noexcept {
  state.near.unload();
  for (ToolState& tool : state.tools) {
    tool.last_contact_wrench = tool.contact_wrench;
    tool.contact_wrench = {};
    tool.contacts = 0;
  }
  for (Index i = 0; i < state.problem.rows; ++i) {
    const ContactRow& row = state.rows[static_cast<std::size_t>(i)];
    const double lambda = state.problem.lambda[static_cast<std::size_t>(i)];
    if (lambda == 0.0) continue;
    for (std::size_t n = 0; n < 3; ++n) {
      if (row.places[n] >= 0) state.near.load(row.places[n], -lambda * row.body[n]);
    }
  }
  state.near.displace();
  for (Index k = 0; k < state.contact_count; ++k) {
    ContactPoint& contact = state.contact_points[static_cast<std::size_t>(k)];
    const auto first = static_cast<std::size_t>(state.problem.first_row(k));
    contact.force.setZero();
    for (Index i = 0; i < state.problem.rows_of(k); ++i)
      contact.force += state.problem.lambda[first + static_cast<std::size_t>(i)] * contact.frame.col(i);
    if (contact.force.squaredNorm() == 0.0) continue;
    ToolState& tool = state.tools[static_cast<std::size_t>(contact.tool)];
    ++tool.contacts;
    if (contact.rigid) tool.status |= StepStatus::rigid_contact;
    tool.contact_wrench.force += contact.force;
    tool.contact_wrench.torque += contact.arm.cross(contact.force);
  }
}

/// Whether a body that swings is let go: some tool has lost what it touched in the tick before, or holds it
/// no longer.
bool lets_go(const Body& body, const State& state) noexcept {
  if (body.model().dynamics.method == DynamicsMethod::none) return false;
  return std::any_of(state.tools.begin(), state.tools.end(), [](const ToolState& tool) {
    return (tool.touched && tool.contacts == 0) || (tool.held && !tool.holding);
  });
}

/// A point that slides over the edge of a fold throws the surface from one side of it to the other, and back
/// in the next tick. Where forces would take the near surface farther than in a step of Newton's method that
/// can be trusted, only a share of their change is made. A body that is let go does not leap: it stays where
/// it is and swings from there.
void retreat_from_leaps(const Body& body, State& state) noexcept {
  if (state.near.load().count == 0 || lets_go(body, state)) return;
  double farthest = 0.0;
  for (Index place = 0; place < state.near.count(); ++place) {
    const Index node = state.near.node(place);
    const Vec3 to = unloaded_position(body, state, node) + state.near.displacement(place);
    farthest = std::max(farthest, (to - state.tree.position(node)).norm());
  }
  double most = most_motion * body.mean_surface_edge();
  for (const ToolState& tool : state.tools) most += tool.margin;
  if (!(farthest > most)) return;
  const double share = most / farthest;
  state.near.retreat(share);
  state.near.displace();
  for (ToolState& tool : state.tools) {
    const Wrench& last = tool.last_contact_wrench;
    tool.contact_wrench.force = last.force + share * (tool.contact_wrench.force - last.force);
    tool.contact_wrench.torque = last.torque + share * (tool.contact_wrench.torque - last.torque);
  }
}

/// The near surface to where it is now.
void move_near_surface(const Body& body, State& state) noexcept {
  for (Index place = 0; place < state.near.count(); ++place) {
    const Index node = state.near.node(place);
    const Vec3 position = unloaded_position(body, state, node) + state.near.displacement(place);
    if (position.allFinite()) state.tree.move(node, position);
  }
}

/// Moves a surface node that is not near a tool.
void move_far(const Body& body, State& state, Index node, const Vec3& u) noexcept {
  if (state.near.place_of(node) >= 0) return;
  const Vec3 position = unloaded_position(body, state, node) + u;
  if (!position.allFinite()) return;
  state.sweep_change = std::max(state.sweep_change, (position - state.tree.position(node)).norm());
  state.tree.move(node, position);
}

/// u of a surface node that the body's nodes give, as it was renewed last.
Vec3 stored_displacement(const Body& body, const State& state, Index node) noexcept {
  const SurfaceParts parts = body.surface_parts(node);
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < parts.stored.size(); ++k)
    sum += parts.weights[k] * vector_at(state.stored_displacement, body.dimension(), parts.stored[k]);
  return sum;
}

/// The rest of the surface follows in slices, a bounded number of nodes a tick: beside the patch by stored
/// nodes.
void move_far_slice(const Body& body, State& state) noexcept {
  const int d = body.dimension();
  const SurfaceLoad& load = state.near.load();
  const auto most = [&](Index budget) {
    return std::min(budget, far_blocks / std::max<Index>(load.count, 1) + 1);
  };
  const Index first = state.next_far_node;
  const Index end = std::min(first + most(State::most_far_nodes), body.greens().nodes());
  const std::span<double> u(state.far_displacement.data(), static_cast<std::size_t>(d * (end - first)));
  body.greens().displacement(load.nodes(), load.forces(), first, u);
  std::copy(u.begin(), u.end(), state.stored_displacement.begin() + std::ptrdiff_t{d} * first);
  Index moves = 0;
  Index stored = first;
  for (; stored < end && moves < most_far_moves; ++stored) {
    moves += static_cast<Index>(body.followers(stored).size());
    for (const Index node : body.followers(stored)) {
      if (state.near.place_in_patch(node) >= 0) continue;
      move_far(body, state, node, stored_displacement(body, state, node));
    }
  }
  state.next_far_node = stored % body.greens().nodes();
  if (state.next_far_node != 0) return;
  state.far_change = state.sweep_change;
  state.sweep_change = 0.0;
}

/// The surface that moves on its own to where it is in this tick: all that is near, and as much around the
/// tools as may have come near since it was looked at.
void follow_free_motion(const Body& body, State& state) noexcept {
  state.motion.begin_tick(body);
  if (!state.motion.active()) return;
  if (state.motion.is_late()) state.status |= StepStatus::late_motion;
  move_near_surface(body, state);
  const auto d = static_cast<std::size_t>(body.dimension());
  for (const ToolState& tool : state.tools) {
    if (!tool.placed) continue;
    const Core core = core_of(tool.tool, tool.pose, body.dimension());
    const double reach =
        tool.tool.radius + tool.margin + 2.0 * std::max(state.far_change, state.sweep_change);
    const std::size_t found =
        std::min(state.tree.near_segment(core.origin, core.end, reach, state.found), state.most_simplices);
    for (std::size_t k = 0; k < found; ++k) {
      for (const Index node : body.simplices().subspan(d * static_cast<std::size_t>(state.found[k]), d)) {
        if (body.surface_moves(node)) move_far(body, state, node, stored_displacement(body, state, node));
      }
    }
  }
}

/// How what a tool touches moves on its own.
void note_surface_change(const State& state, ToolState& tool, Index number) noexcept {
  tool.surface_change.setZero();
  if (!state.motion.active()) return;
  double sum = 0.0;
  for (const ContactPoint& contact : state.contacts()) {
    const double force = contact.tool == number ? contact.force.norm() : 0.0;
    for (std::size_t n = 0; n < 3; ++n) {
      if (contact.nodes[n] >= 0)
        tool.surface_change += force * contact.weights[n] * state.motion.change(contact.nodes[n]);
    }
    sum += force;
  }
  if (sum > 0.0) tool.surface_change /= sum;
}

/// Forces that ended with this tick become free motion.
void let_go(const Body& body, State& state) noexcept {
  if (lets_go(body, state)) {
    state.motion.let_go(body, state.near.load(), state.stored_displacement);
    move_near_surface(body, state);
  }
  state.motion.end_tick(body, state.near.load());
}

/// What the near field knows of the body's nodes.
void renew_stored_displacement(const Body& body, State& state) noexcept {
  for (Index place = 0; place < state.near.count(); ++place) {
    const auto node = static_cast<std::size_t>(state.near.node(place));
    if (node >= body.surface_stored_nodes().size()) continue;
    set_vector(state.stored_displacement, body.dimension(), body.surface_stored_nodes()[node],
               state.near.displacement(place));
  }
}

/// And the surface of the patch.
void move_patch_slice(const Body& body, State& state) noexcept {
  if (state.near.patch() == nullptr) return;
  const std::span<const Index> nodes = state.near.patch()->surface_nodes();
  const auto count = static_cast<Index>(nodes.size());
  state.next_patch_node %= count;
  const Index end = std::min(state.next_patch_node + State::most_far_patch_nodes, count);
  const std::span<double> u(state.far_displacement.data(),
                            static_cast<std::size_t>(body.dimension() * (end - state.next_patch_node)));
  patch_displacement(state.near.load(), state.next_patch_node, u);
  for (Index k = state.next_patch_node; k < end; ++k)
    move_far(body, state, nodes[static_cast<std::size_t>(k)],
             vector_at(u, body.dimension(), k - state.next_patch_node));
  state.next_patch_node = end;
}

/// Deepest penetration at the contact points, as the tick before or the pass before left it [m].
double penetration(const State& state) noexcept {
  double deepest = 0.0;
  for (const ContactPoint& contact : state.contacts()) {
    if (!contact.held) deepest = std::max(deepest, -contact.gap);
  }
  return deepest;
}

/// Contact about where everything is now: detection, forces, and where they take tools and surface. False
/// when the forces are no numbers: everything but the contact points stays as it was.
bool solve_contact(const Body& body, State& state) noexcept {
  assemble_contact(body, state);
  const bool solved = state.problem.frictionless ? state.active_set.solve(state.problem)
                                                 : state.cone_solver.solve(state.problem);
  if (!solved) state.status |= StepStatus::not_converged;
  if (!is_finite(state.problem)) {
    state.status |= StepStatus::result_not_finite;
    return false;
  }
  apply_forces(state);
  retreat_from_leaps(body, state);
  move_tools(body, state);
  move_near_surface(body, state);
  return true;
}

void remember_contacts(State& state) noexcept {
  std::copy_n(state.contact_points.begin(), state.contact_count, state.last_contacts.begin());
  state.last_count = state.contact_count;
}

/// Back to the contacts that were solved for.
void recall_contacts(State& state) noexcept {
  std::copy_n(state.last_contacts.begin(), state.last_count, state.contact_points.begin());
  state.contact_count = state.last_count;
}

}  // namespace

StepStatus step(const Body& body, State& state, std::span<const ToolPose> poses) noexcept {
  ++state.ticks;
  state.status = state.patch_is_older ? StepStatus::older_patch : StepStatus::ok;
  follow_free_motion(body, state);
  for (std::size_t k = 0; k < state.tools.size(); ++k) {
    ToolState& tool = state.tools[k];
    tool.status = StepStatus::ok;
    tool.touched = tool.contacts > 0;
    tool.held = tool.holding;
    follow_device(body, state, tool, poses[k]);
  }
  state.near.begin_tick();
  remember_contacts(state);
  update_holds(body, state);

  // A pass is a Newton step: one is enough but for contact that slips far in a tick.
  const double rough = rough_penetration * body.mean_surface_edge();
  find_contacts(body, state);
  if (state.patch != state.near.patch() && !state.near.change_patch(body, state.patch)) {
    state.patch = state.near.patch();
    state.status |= StepStatus::capacity_full;
  }
  bool again = penetration(state) > rough;
  state.is_first_pass = true;
  bool valid = solve_contact(body, state);
  state.is_first_pass = false;
  const auto easy = [&] { return state.problem.frictionless || state.cone_solver.was_easy(); };
  for (int pass = 1; again && valid && easy() && !lets_go(body, state) && pass < most_passes; ++pass) {
    remember_contacts(state);
    find_contacts(body, state);
    again = penetration(state) > rough;
    if (again) {
      valid = solve_contact(body, state);
    } else {
      recall_contacts(state);
    }
  }
  if (valid) {
    linearise(state);
    for (std::size_t k = 0; k < state.tools.size(); ++k) {
      note_surface_change(state, state.tools[k], static_cast<Index>(k));
      give_force(state.tools[k], state.tick);
    }
  }
  let_go(body, state);
  renew_stored_displacement(body, state);
  move_far_slice(body, state);
  move_patch_slice(body, state);
  for (const ToolState& tool : state.tools) state.status |= tool.status;
  return state.status;
}

StepStatus step(const Body& body, State& state, const ToolPose& pose) noexcept {
  return step(body, state, std::span<const ToolPose>(&pose, 1));
}

void surface_displacement(const Body& body, const State& state, std::span<double> u) noexcept {
  body.greens().displacement(state.near.load().nodes(), state.near.load().forces(), u);
  if (!state.motion.active()) return;
  const int d = body.dimension();
  for (Index node = 0; node < body.greens().nodes(); ++node)
    set_vector(u, d, node, vector_at(u, d, node) + state.motion.displacement(body, node));
}

}  // namespace palpate
