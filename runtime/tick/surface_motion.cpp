#include "runtime/tick/surface_motion.h"

#include <algorithm>

#include "runtime/solve/node_vectors.h"
#include "runtime/tick/contact_detection.h"
#include "runtime/tick/state.h"

namespace palpate {
namespace {

constexpr Index far_blocks = 512;     // pairs of loaded and renewed nodes a tick
constexpr Index most_far_moves = 64;  // surface nodes that are moved with them

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

}  // namespace

void move_near_surface(const Body& body, State& state) noexcept {
  for (Index place = 0; place < state.near.count(); ++place) {
    const Index node = state.near.node(place);
    const Vec3 position = unloaded_position(body, state, node) + state.near.displacement(place);
    if (position.allFinite()) state.tree.move(node, position);
  }
}

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

void renew_stored_displacement(const Body& body, State& state) noexcept {
  for (Index place = 0; place < state.near.count(); ++place) {
    const auto node = static_cast<std::size_t>(state.near.node(place));
    if (node >= body.surface_stored_nodes().size()) continue;
    set_vector(state.stored_displacement, body.dimension(), body.surface_stored_nodes()[node],
               state.near.displacement(place));
  }
}

void renew_far_surface(const Body& body, State& state) noexcept {
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

void renew_patch_surface(const Body& body, State& state) noexcept {
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

}  // namespace palpate
