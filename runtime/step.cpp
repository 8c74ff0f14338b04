#include "runtime/step.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <string>

#include "meshes/error.h"
#include "runtime/hand_force.h"
#include "runtime/local_model.h"
#include "runtime/node_vectors.h"

namespace palpate {
namespace {

constexpr double tree_margin = 0.1;   // of the mean edge: how much larger boxes are
constexpr double base_margin = 0.03;   // of the mean edge: how far a surface is looked for at least
constexpr double most_motion = 0.25;  // of the mean edge or the radius: what a tool may move in a tick
constexpr Index far_blocks = 1024;    // pairs of loaded and renewed nodes a tick
constexpr Index most_far_nodes = 64;
constexpr double rough_penetration = 0.002;  // of the mean edge: more calls for another pass
constexpr int most_passes = 3;
constexpr double largest_number = 1e100;  // that is a force
constexpr double rigid_share = 1e-9;      // compliance of the rigid, of the body's

void check(const Tool& tool, std::size_t number) {
  const auto check = [&](const char* what, double value, bool valid, const char* hint) {
    if (valid) return;
    throw Error(
        "the " + std::string(what) + " of tool " + std::to_string(number) + " is " + std::to_string(value),
        "State", hint);
  };
  const auto size = [&](const char* what, double value) {
    check(what, value, std::isfinite(value) && value >= 0.0, "give a finite number that is not negative");
  };
  const auto bound = [&](const char* what, double value) {
    check(what, value, value > 0.0, "give a positive number, infinite for none");
  };
  size("radius", tool.radius);
  size("length", tool.length);
  size("reach", tool.reach);
  size("friction", tool.friction.value_or(0.0));
  bound("coupling stiffness", tool.coupling_stiffness);
  bound("coupling torsion", tool.coupling_torsion);
  bound("largest force", tool.max_force);
  bound("hand-over", tool.hand_over);
}

std::vector<ToolState> make_tools(const StateOptions& options) {
  if (options.tools.empty()) throw Error("there is no tool", "State", "give at least one");
  if (options.max_contacts < 1) {
    throw Error("room for " + std::to_string(options.max_contacts) + " contacts was asked for", "State",
                "ask for room for at least one");
  }
  std::vector<ToolState> tools;
  for (const Tool& tool : options.tools) {
    check(tool, tools.size());
    tools.emplace_back().tool = tool;
  }
  return tools;
}

/// Mean of the surface's own compliance over some nodes: the scale of what is soft.
double mean_compliance(const Body& body) {
  const std::vector<Index>& nodes = body.free_surface_nodes();
  const std::size_t stride = std::max<std::size_t>(1, nodes.size() / 64);
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t k = 0; k < nodes.size(); k += stride) {
    sum += body.greens().block(nodes[k], nodes[k]).trace() / body.dimension();
    count += 1.0;
  }
  return sum / count;
}

Index near_room(const StateOptions& options) {
  return 3 * options.max_contacts + 32;
}

/// A contact has up to d rows, and d - 1 for the tilt of its face.
Index most_rows(const Body& body, const StateOptions& options) {
  return (2 * body.dimension() - 1) * options.max_contacts;
}

Index entries(const Body& body, const StateOptions& options) {
  return body.dimension() * options.max_contacts;
}

bool make_valid(ToolPose& pose, int dimension) noexcept {
  if (!pose.position.allFinite() || !pose.orientation.coeffs().allFinite()) return false;
  if (dimension == 2) {
    pose.position.z() = 0.0;
    pose.orientation.x() = 0.0;
    pose.orientation.y() = 0.0;
  }
  const double norm = pose.orientation.coeffs().stableNorm();
  if (!(norm > 1e-6)) return false;
  pose.orientation.coeffs() /= norm;
  return std::isfinite(norm);
}

/// How far a tool's points move at most from one pose to another.
double motion(const Tool& tool, const ToolPose& from, const ToolPose& to) noexcept {
  const double turned =
      tool.length > 0.0 || tool.radius > 0.0 ? from.orientation.angularDistance(to.orientation) : 0.0;
  return (to.position - from.position).norm() + turned * (tool.length + tool.radius);
}

ToolPose between(const ToolPose& from, const ToolPose& to, double share) noexcept {
  return {.orientation = from.orientation.slerp(share, to.orientation),
          .position = from.position + share * (to.position - from.position),
          .grab = to.grab};
}

/// The device's pose for this tick: where it wants to be, but no farther from the last one than contact can
/// follow; through free space as far as it is free.
void follow_device(const Body& body, State& state, ToolState& tool, ToolPose wanted) noexcept {
  tool.last_device_position = tool.device.position;
  if (!make_valid(wanted, body.dimension())) {
    tool.status |= StepStatus::pose_not_finite;
    wanted = tool.device;
    if (!tool.placed) return;
  }
  const double size = std::max(body.mean_surface_edge(), tool.tool.radius);
  const double least = base_margin * body.mean_surface_edge();
  const auto place = [&] {
    if (!tool.placed) tool.last_device_position = wanted.position;
    tool.pose = tool.device = wanted;
    tool.margin = least;
    tool.placed = true;
  };
  if (!tool.placed || !tool.engaged) {
    place();
    tool.engaged = is_clear(body, state, tool.tool, wanted);
    if (!tool.engaged) tool.status |= StepStatus::inside_body;
    return;
  }

  const double wish = motion(tool.tool, tool.device, wanted);
  double most = most_motion * size;
  if (wish > most && tool.contacts == 0 && !tool.holding) {
    const double free = std::sqrt(state.tree.nearest(tool.device.position).nearest.squared_distance) -
                        tool.tool.radius - tool.tool.length - least;
    most = std::max(most, free);
    if (wish <= free) return place();
  }
  if (wish > most) {
    tool.status |= StepStatus::pose_limited;
    wanted = between(tool.device, wanted, most / wish);
  }
  tool.device = wanted;
  tool.margin = least + 2.0 * std::min(wish, most_motion * size);  // tool and surface may meet
  if (tool.contacts == 0 && !tool.holding) {  // free: it is where the device was
    const double moved = motion(tool.tool, tool.pose, tool.device);
    tool.margin = least + 2.0 * std::min(moved, most_motion * size);
  }
}

void hold_contact(State& state, const ContactPoint& contact) noexcept {
  const ToolState& tool = state.tools[static_cast<std::size_t>(contact.tool)];
  ContactPoint held = contact;
  held.held = true;
  held.feature = -1 - state.held_count;
  held.frame.setIdentity();
  held.tool_point = tool.pose.orientation.conjugate() * (contact.position - tool.pose.position);
  state.contact_points[static_cast<std::size_t>(state.held_count++)] = held;
}

/// The nearest place of the surface within reach, as a contact.
bool reach_out(const Body& body, State& state, Index number) noexcept {
  ToolState& tool = state.tools[static_cast<std::size_t>(number)];
  const NearestSimplex found = state.tree.nearest(tool.pose.position);
  if (!(found.nearest.squared_distance <= tool.tool.reach * tool.tool.reach)) return false;
  ContactPoint contact;
  contact.tool = number;
  contact.simplex = found.simplex;
  contact.weights = found.nearest.weights;
  contact.position = found.nearest.on_simplex;
  const auto d = static_cast<std::size_t>(body.dimension());
  bool free = false;
  for (std::size_t k = 0; k < d; ++k) {
    if (contact.weights[k] == 0.0) continue;
    contact.nodes[k] = body.simplices()[d * static_cast<std::size_t>(found.simplex) + k];
    free = free || body.surface_stored_nodes()[static_cast<std::size_t>(contact.nodes[k])] >= 0;
  }
  if (!free) return false;
  hold_contact(state, contact);
  return true;
}

/// Grab: what is closed is held; if nothing is, the surface within reach.
void begin_hold(const Body& body, State& state, Index number) noexcept {
  ToolState& tool = state.tools[static_cast<std::size_t>(number)];
  const Index before = state.held_count;
  for (Index k = 0; k < state.last_count && state.held_count < state.max_contacts; ++k) {
    const ContactPoint& contact = state.last_contacts[static_cast<std::size_t>(k)];
    if (contact.tool == number && !contact.held && contact.force.dot(contact.frame.col(0)) > 0.0)
      hold_contact(state, contact);
  }
  tool.holding = state.held_count > before;
  if (tool.holding || state.held_count == state.max_contacts) return;
  tool.holding = reach_out(body, state, number);
  if (!tool.holding) tool.status |= StepStatus::nothing_in_reach;
}

void end_hold(State& state, Index number) noexcept {
  const auto begin = state.contact_points.begin();
  const auto end = std::remove_if(begin, begin + state.held_count,
                                  [&](const ContactPoint& contact) { return contact.tool == number; });
  state.held_count = static_cast<Index>(end - begin);
  state.tools[static_cast<std::size_t>(number)].holding = false;
}

void update_holds(const Body& body, State& state) noexcept {
  for (Index k = 0; k < static_cast<Index>(state.tools.size()); ++k) {
    const ToolState& tool = state.tools[static_cast<std::size_t>(k)];
    if (tool.device.grab && !tool.holding && tool.placed) begin_hold(body, state, k);
    if (!tool.device.grab && tool.holding) end_hold(state, k);
  }
}

bool is_finite(const ContactProblem& problem) noexcept {
  return std::all_of(problem.lambda.begin(), problem.lambda.begin() + problem.rows,
                     [](double value) { return std::abs(value) < largest_number; });
}

/// Forces to the contacts, the near field and the tools.
void apply_forces(State& state) noexcept {
  state.near.unload();
  for (ToolState& tool : state.tools) {
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
    const Index first = state.problem.first_row(k);
    contact.force.setZero();
    for (Index i = 0; i < state.problem.rows_of(k); ++i)
      contact.force += state.problem.lambda[static_cast<std::size_t>(first + i)] * contact.frame.col(i);
    if (contact.force.squaredNorm() == 0.0) continue;
    ToolState& tool = state.tools[static_cast<std::size_t>(contact.tool)];
    ++tool.contacts;
    tool.contact_wrench.force += contact.force;
    tool.contact_wrench.torque += contact.arm.cross(contact.force);
  }
}

void move_tools(const Body& body, State& state) noexcept {
  for (ToolState& tool : state.tools) {
    ToolPose pose = tool.device;
    pose.position += tool.contact_wrench.force / tool.tool.coupling_stiffness;
    const Vec3 turn = tool.contact_wrench.torque / tool.tool.coupling_torsion;
    const double angle = turn.norm();
    if (angle > 0.0) pose.orientation = Eigen::AngleAxisd(angle, turn / angle) * pose.orientation;
    const double most = most_motion * std::max(body.mean_surface_edge(), tool.tool.radius) + tool.margin;
    const double moved = motion(tool.tool, tool.pose, pose);
    tool.pose = moved > most ? between(tool.pose, pose, most / moved) : pose;
  }
}

/// The near surface to where it is now.
void move_near_surface(const Body& body, State& state) noexcept {
  for (Index place = 0; place < state.near.count(); ++place) {
    const Index node = state.near.node(place);
    const Vec3 position =
        body.surface_rest_positions()[static_cast<std::size_t>(node)] + state.near.displacement(place);
    if (position.allFinite()) state.tree.move(node, position);
  }
}

/// The rest of the surface follows in slices, a bounded number of nodes a tick.
void move_far_slice(const Body& body, State& state) noexcept {
  const auto d = static_cast<std::size_t>(body.dimension());
  const Index loaded = static_cast<Index>(state.near.loaded_nodes().size());
  const Index count = std::min({most_far_nodes, far_blocks / std::max<Index>(loaded, 1) + 1,
                                body.greens().nodes() - state.next_far_node});
  const std::span<double> u(state.far_displacement.data(), d * static_cast<std::size_t>(count));
  body.greens().displacement(state.near.loaded_nodes(), state.near.loaded_forces(), state.next_far_node, u);
  for (Index k = 0; k < count; ++k) {
    const Index node = body.surface_node_of_stored(state.next_far_node + k);
    if (node < 0 || state.near.place_of(node) >= 0) continue;
    const Vec3 position =
        body.surface_rest_positions()[static_cast<std::size_t>(node)] + vector_at(u, body.dimension(), k);
    if (position.allFinite()) state.tree.move(node, position);
  }
  state.next_far_node = (state.next_far_node + count) % body.greens().nodes();
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

State::State(const Body& body, const StateOptions& options)
    : tools(make_tools(options)),
      contact_points(static_cast<std::size_t>(options.max_contacts)),
      max_contacts(options.max_contacts),
      near(body, near_room(options)),
      tree(body.simplices(), body.dimension(), body.surface_rest_positions(),
           tree_margin * body.mean_surface_edge()),
      problem(body.dimension(), entries(body, options), most_rows(body, options)),
      active_set(most_rows(body, options)),
      cone_solver(entries(body, options), most_rows(body, options)),
      rows(static_cast<std::size_t>(most_rows(body, options))),
      row_response(static_cast<std::size_t>(body.dimension() * near_room(options))),
      rigid_compliance(rigid_share * mean_compliance(body)),
      most_simplices(2 * static_cast<std::size_t>(options.max_contacts)),
      found(body.surface_friction().size()),
      found_distance(body.surface_friction().size()),
      pairs(most_simplices),
      candidates(3 * most_simplices * tools.size()),
      last_contacts(static_cast<std::size_t>(options.max_contacts)),
      row_change(rows.size()),
      force_change(rows.size()),
      far_displacement(static_cast<std::size_t>(body.dimension() * most_far_nodes)) {}

StepStatus step(const Body& body, State& state, std::span<const ToolPose> poses) noexcept {
  ++state.ticks;
  state.status = StepStatus::ok;
  for (std::size_t k = 0; k < state.tools.size(); ++k) {
    state.tools[k].status = StepStatus::ok;
    follow_device(body, state, state.tools[k], poses[k]);
  }
  state.near.begin_tick();
  remember_contacts(state);
  update_holds(body, state);

  // A pass is a Newton step: one is enough but for contact that slips far in a tick.
  const double rough = rough_penetration * body.mean_surface_edge();
  find_contacts(body, state);
  bool again = penetration(state) > rough;
  bool valid = solve_contact(body, state);
  for (int pass = 1; again && valid && pass < most_passes; ++pass) {
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
    for (ToolState& tool : state.tools) give_force(tool);
  }
  move_far_slice(body, state);
  for (const ToolState& tool : state.tools) state.status |= tool.status;
  return state.status;
}

StepStatus step(const Body& body, State& state, const ToolPose& pose) noexcept {
  return step(body, state, std::span<const ToolPose>(&pose, 1));
}

void surface_displacement(const Body& body, const State& state, std::span<double> u) noexcept {
  body.greens().displacement(state.near.loaded_nodes(), state.near.loaded_forces(), u);
}

}  // namespace palpate
