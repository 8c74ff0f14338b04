#include "runtime/step.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "meshes/error.h"
#include "runtime/node_vectors.h"

namespace palpate {
namespace {

bool is_finite(const ToolPose& tool) noexcept {
  return tool.position.allFinite() && tool.orientation.coeffs().allFinite();
}

bool all_finite(std::span<const double> values) noexcept {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

std::size_t dofs(int dimension, Index nodes) noexcept {
  return static_cast<std::size_t>(dimension) * static_cast<std::size_t>(nodes);
}

/// Closes the gap of the entries of one node: those of the later nodes move up.
template <class T>
void erase_entries(std::vector<T>& values, Index k, Index nodes, std::ptrdiff_t entries) noexcept {
  T* gap = values.data() + entries * k;
  std::copy(gap + entries, values.data() + entries * nodes, gap);
}

StepStatus take_hold(const Body& body, State& state, const Vec3& tool_position) noexcept {
  const NearestNode nearest = body.nearest_surface_node(tool_position);
  if (!(nearest.distance <= state.reach)) return StepStatus::nothing_in_reach;
  const StepStatus status = hold(body, state, nearest.node);
  if (status != StepStatus::ok) return status;
  state.tool_node = nearest.node;
  state.tool_position_at_grab = tool_position;
  state.node_displacement_at_grab =
      vector_at(state.prescribed_displacement, state.dimension(), held_position(state, nearest.node));
  return StepStatus::ok;
}

StepStatus let_go(State& state) noexcept {
  const StepStatus released = release(state, state.tool_node);
  return released | solve(state);
}

/// Moves the held node with the tool; where that overflows, everything stays as it was.
StepStatus follow(State& state, const Vec3& tool_position) noexcept {
  const int d = state.dimension();
  const Index k = held_position(state, state.tool_node);
  const Vec3 before = vector_at(state.prescribed_displacement, d, k);
  set_vector(state.prescribed_displacement, d, k,
             state.node_displacement_at_grab + (tool_position - state.tool_position_at_grab));
  const StepStatus status = solve(state);
  if (has(status, StepStatus::result_not_finite)) set_vector(state.prescribed_displacement, d, k, before);
  return status;
}

void show_tool(State& state) noexcept {
  const int d = state.dimension();
  const Index k = held_position(state, state.tool_node);
  state.tool_force = k < 0 ? Vec3::Zero() : vector_at(state.force, d, k);
  state.tool_node_displacement = k < 0 ? Vec3::Zero() : vector_at(state.prescribed_displacement, d, k);
}

}  // namespace

State::State(const Body& body, const StateOptions& options)
    : reach(options.reach),
      capacitance(body.dimension(), options.max_nodes),
      held_nodes(static_cast<std::size_t>(options.max_nodes), -1),
      prescribed_displacement(dofs(body.dimension(), options.max_nodes)),
      force(dofs(body.dimension(), options.max_nodes)),
      work(static_cast<std::size_t>(body.dimension()) * dofs(body.dimension(), options.max_nodes)) {
  if (!std::isfinite(reach) || reach <= 0.0) {
    throw Error("the reach of the tool is " + std::to_string(reach) + " m", "State",
                "give a positive length in metres");
  }
}

std::span<const Index> State::held() const noexcept {
  return {held_nodes.data(), static_cast<std::size_t>(nodes())};
}
std::span<const double> State::prescribed() const noexcept {
  return {prescribed_displacement.data(), dofs(dimension(), nodes())};
}
std::span<const double> State::forces() const noexcept {
  return {force.data(), dofs(dimension(), nodes())};
}

StepStatus step(const Body& body, State& state, const ToolPose& tool) noexcept {
  ++state.ticks;
  state.status = StepStatus::ok;
  if (!is_finite(tool)) return state.status = StepStatus::pose_not_finite;

  if (tool.grab && state.tool_node < 0) state.status = take_hold(body, state, tool.position);
  if (!tool.grab && state.tool_node >= 0) state.status = let_go(state);
  if (state.tool_node >= 0) state.status = state.status | follow(state, tool.position);
  show_tool(state);
  return state.status;
}

StepStatus hold(const Body& body, State& state, Index node) noexcept {
  if (node < 0 || node >= body.greens().nodes()) return StepStatus::no_such_node;
  if (held_position(state, node) >= 0) return StepStatus::ok;
  const Index k = state.nodes();
  if (k == state.capacitance.max_nodes()) return StepStatus::capacity_full;

  state.held_nodes[static_cast<std::size_t>(k)] = node;
  const auto d = static_cast<std::size_t>(state.dimension());
  const std::size_t width = d * static_cast<std::size_t>(k + 1);
  const std::span<double> blocks(state.work.data(), d * width);
  body.greens().gather(node, {state.held_nodes.data(), static_cast<std::size_t>(k + 1)}, blocks);

  Vec3 displacement = Vec3::Zero();
  for (std::size_t axis = 0; axis < d; ++axis) {
    const auto row = static_cast<Eigen::Index>(axis);
    for (std::size_t j = 0; j < width - d; ++j)
      displacement[row] += blocks[axis * width + j] * state.force[j];
  }
  if (state.capacitance.add(blocks) != CapacitanceStatus::ok) return StepStatus::not_positive_definite;
  set_vector(state.prescribed_displacement, state.dimension(), k, displacement);
  set_vector(state.force, state.dimension(), k, Vec3::Zero());
  return StepStatus::ok;
}

StepStatus release(State& state, Index node) noexcept {
  const Index k = held_position(state, node);
  if (k < 0) return StepStatus::no_such_node;
  const Index nodes = state.nodes();
  erase_entries(state.held_nodes, k, nodes, 1);
  erase_entries(state.prescribed_displacement, k, nodes, state.dimension());
  erase_entries(state.force, k, nodes, state.dimension());
  state.capacitance.remove(k);
  if (node == state.tool_node) state.tool_node = -1;
  return StepStatus::ok;
}

void release_all(State& state) noexcept {
  state.capacitance.clear();
  state.tool_node = -1;
  show_tool(state);
}

StepStatus prescribe(State& state, Index node, const Vec3& displacement) noexcept {
  const Index k = held_position(state, node);
  if (k < 0) return StepStatus::no_such_node;
  set_vector(state.prescribed_displacement, state.dimension(), k, displacement);
  return StepStatus::ok;
}

StepStatus solve(State& state) noexcept {
  const std::span<double> f(state.work.data(), dofs(state.dimension(), state.nodes()));
  std::copy_n(state.prescribed_displacement.begin(), f.size(), f.begin());
  state.capacitance.solve(f);
  if (!all_finite(f)) return StepStatus::result_not_finite;
  std::copy(f.begin(), f.end(), state.force.begin());
  return StepStatus::ok;
}

Index held_position(const State& state, Index node) noexcept {
  const std::span<const Index> held = state.held();
  const auto found = std::find(held.begin(), held.end(), node);
  return found == held.end() ? -1 : static_cast<Index>(found - held.begin());
}

void surface_displacement(const Body& body, const State& state, std::span<double> u) noexcept {
  body.greens().displacement(state.held(), state.forces(), u);
}

}  // namespace palpate
