#include "runtime/step.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "meshes/error.h"

namespace palpate {
namespace {

using VectorMap = Eigen::Map<Vec3>;

bool is_finite(const ToolPose& tool) noexcept {
  return tool.position.allFinite() && tool.orientation.coeffs().allFinite();
}

bool all_finite(std::span<const double> values) noexcept {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

VectorMap vector_at(std::vector<double>& values, Index k) noexcept {
  return VectorMap(values.data() + 3 * std::ptrdiff_t{k});
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
      vector_at(state.prescribed_displacement, held_position(state, nearest.node));
  return StepStatus::ok;
}

StepStatus let_go(State& state) noexcept {
  const StepStatus released = release(state, state.tool_node);
  return released | solve(state);
}

/// Moves the held node with the tool; where that overflows, everything stays as it was.
StepStatus follow(State& state, const Vec3& tool_position) noexcept {
  VectorMap displacement = vector_at(state.prescribed_displacement, held_position(state, state.tool_node));
  const Vec3 before = displacement;
  displacement = state.node_displacement_at_grab + (tool_position - state.tool_position_at_grab);
  const StepStatus status = solve(state);
  if (has(status, StepStatus::result_not_finite)) displacement = before;
  return status;
}

void show_tool(State& state) noexcept {
  const Index k = held_position(state, state.tool_node);
  state.tool_force = k < 0 ? Vec3::Zero() : Vec3(vector_at(state.force, k));
  state.tool_node_displacement = k < 0 ? Vec3::Zero() : Vec3(vector_at(state.prescribed_displacement, k));
}

}  // namespace

State::State(const StateOptions& options)
    : reach(options.reach),
      capacitance(options.max_nodes),
      held_nodes(static_cast<std::size_t>(options.max_nodes), -1),
      prescribed_displacement(3 * static_cast<std::size_t>(options.max_nodes)),
      force(3 * static_cast<std::size_t>(options.max_nodes)),
      work(9 * static_cast<std::size_t>(options.max_nodes)) {
  if (!std::isfinite(reach) || reach <= 0.0) {
    throw Error("the reach of the tool is " + std::to_string(reach) + " m", "State",
                "give a positive length in metres");
  }
}

std::span<const Index> State::held() const noexcept {
  return {held_nodes.data(), static_cast<std::size_t>(nodes())};
}
std::span<const double> State::prescribed() const noexcept {
  return {prescribed_displacement.data(), 3 * static_cast<std::size_t>(nodes())};
}
std::span<const double> State::forces() const noexcept {
  return {force.data(), 3 * static_cast<std::size_t>(nodes())};
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
  const auto width = 3 * static_cast<std::size_t>(k + 1);
  const std::span<double> blocks(state.work.data(), 3 * width);
  body.greens().gather(node, {state.held_nodes.data(), static_cast<std::size_t>(k + 1)}, blocks);

  Vec3 displacement = Vec3::Zero();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto row = static_cast<Eigen::Index>(axis);
    for (std::size_t j = 0; j < width - 3; ++j)
      displacement[row] += blocks[axis * width + j] * state.force[j];
  }
  if (state.capacitance.add(blocks) != CapacitanceStatus::ok) return StepStatus::not_positive_definite;
  vector_at(state.prescribed_displacement, k) = displacement;
  vector_at(state.force, k).setZero();
  return StepStatus::ok;
}

StepStatus release(State& state, Index node) noexcept {
  const Index k = held_position(state, node);
  if (k < 0) return StepStatus::no_such_node;
  const Index nodes = state.nodes();
  erase_entries(state.held_nodes, k, nodes, 1);
  erase_entries(state.prescribed_displacement, k, nodes, 3);
  erase_entries(state.force, k, nodes, 3);
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
  vector_at(state.prescribed_displacement, k) = displacement;
  return StepStatus::ok;
}

StepStatus solve(State& state) noexcept {
  const std::span<double> f(state.work.data(), 3 * static_cast<std::size_t>(state.nodes()));
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
