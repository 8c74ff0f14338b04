// One tick: tool in, force and displacement out.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "runtime/body.h"
#include "runtime/capacitance.h"

namespace palpate {

/// Where the tool is. On a body in the plane its z is ignored.
struct ToolPose {
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  Vec3 position = Vec3::Zero();  ///< tip [m]
  bool grab = false;             ///< the tool wants to hold
};

/// What a tick or a call could not do; bits, none set when all is well.
enum class StepStatus : std::uint32_t {
  ok = 0,
  nothing_in_reach = 1U << 0,       ///< grab is set, and no free surface node is within reach
  capacity_full = 1U << 1,          ///< as many nodes are held as there is room for
  not_positive_definite = 1U << 2,  ///< the node cannot be held beside those that are
  pose_not_finite = 1U << 3,        ///< the pose was ignored: the last valid result stands
  result_not_finite = 1U << 4,      ///< the force overflowed: the last valid result stands
  no_such_node = 1U << 5,           ///< not a stored node, or not a held one
};

constexpr StepStatus operator|(StepStatus a, StepStatus b) noexcept {
  return static_cast<StepStatus>(static_cast<std::uint32_t>(a) | static_cast<std::uint32_t>(b));
}
constexpr bool has(StepStatus status, StepStatus bit) noexcept {
  return (static_cast<std::uint32_t>(status) & static_cast<std::uint32_t>(bit)) != 0;
}

/// The bits and their names, for reports.
inline constexpr std::array<std::pair<StepStatus, const char*>, 6> status_names = {{
    {StepStatus::nothing_in_reach, "nothing_in_reach"},
    {StepStatus::capacity_full, "capacity_full"},
    {StepStatus::not_positive_definite, "not_positive_definite"},
    {StepStatus::pose_not_finite, "pose_not_finite"},
    {StepStatus::result_not_finite, "result_not_finite"},
    {StepStatus::no_such_node, "no_such_node"},
}};

struct StateOptions {
  double reach = 0.01;    ///< farthest node that the tool takes hold of [m]
  Index max_nodes = 256;  ///< most nodes that can be held at once
};

/// Everything that a tick changes on one body. Copies are complete and independent, so that reset, record and
/// replay are copies. All memory is taken here: copying allocates, a tick does not. Vectors are sized for
/// `max_nodes`; only the first nodes() entries count. Displacements are those by contact, relative to rest;
/// d numbers a node, d = dimension(), where they are not vectors in space (z = 0 in the plane).
struct State {
  /// Of a body at rest. Throws Error for a reach that is not finite and positive, or without room for a node.
  explicit State(const Body& body, const StateOptions& options = {});

  [[nodiscard]] int dimension() const noexcept { return capacitance.dimension(); }  ///< d, dofs a node
  [[nodiscard]] Index nodes() const noexcept { return capacitance.nodes(); }  ///< m, number of held nodes
  [[nodiscard]] std::span<const Index> held()
      const noexcept;  ///< [m] stored nodes, in the order they were taken
  [[nodiscard]] std::span<const double> prescribed() const noexcept;  ///< [dm] their displacement [m]
  [[nodiscard]] std::span<const double> forces() const noexcept;      ///< [dm] forces on the body there [N]

  double reach;  ///< [m]
  CapacitanceMatrix capacitance;
  std::vector<Index> held_nodes;
  std::vector<double> prescribed_displacement;
  std::vector<double> force;
  std::vector<double>
      work;  ///< [d d max_nodes] a block row of C, or the force before it is known to be finite

  Index tool_node = -1;                           ///< stored node that the tool holds, -1 for none
  Vec3 tool_position_at_grab = Vec3::Zero();      ///< [m]
  Vec3 node_displacement_at_grab = Vec3::Zero();  ///< [m]
  Vec3 tool_force = Vec3::Zero();  ///< on the body at the tool's node [N]; the hand feels the opposite
  Vec3 tool_node_displacement = Vec3::Zero();  ///< of the tool's node [m]; zero while it holds nothing
  StepStatus status = StepStatus::ok;          ///< of the last tick
  std::int64_t ticks = 0;                      ///< taken so far
};

/// One tick. While `grab` is set the tool holds the free surface node that was nearest to it, within reach,
/// when it first could: the node is displaced by what the tool has moved since, so that nothing jumps at the
/// grab. The forces are those of the capacitance matrix algorithm, f = C^-1 u (theory.md section 3). Nodes
/// held by `hold` stay held. No heap, lock, system call or exception; never a force that is not finite.
StepStatus step(const Body& body, State& state, const ToolPose& tool) noexcept;

/// Takes hold of a stored node where it is now, so that no force changes. A node that is held stays so (ok).
StepStatus hold(const Body& body, State& state, Index node) noexcept;

/// Lets go of a stored node. The other forces are out of date until `solve`.
StepStatus release(State& state, Index node) noexcept;

/// Lets go of all nodes.
void release_all(State& state) noexcept;

/// Prescribes the displacement [m] of a held node, relative to rest; z is ignored in the plane. Forces are
/// out of date until `solve`.
StepStatus prescribe(State& state, Index node, const Vec3& displacement) noexcept;

/// f = C^-1 u: the forces on the body that give the held nodes their prescribed displacement (theory.md
/// section 3).
StepStatus solve(State& state) noexcept;

/// Position of a stored node among the held ones, -1 when it is not held.
Index held_position(const State& state, Index node) noexcept;

/// u = Xi E f: displacement u [n] of all stored nodes [m] by the present forces, relative to rest (theory.md
/// section 3). What is seen is node + u0 + u. For the eye; not needed by a tick.
void surface_displacement(const Body& body, const State& state, std::span<double> u) noexcept;

}  // namespace palpate
