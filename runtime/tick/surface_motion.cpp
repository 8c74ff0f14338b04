#include "runtime/tick/surface_motion.h"

#include <algorithm>
#include <cmath>

#include "runtime/solve/node_vectors.h"
#include "runtime/solve/tick_tuning.h"
#include "runtime/touch/touching_pair.h"

namespace palpate {
namespace {

/// Moves a surface node that is not near a tool.
void move_far(const Body& body, SurfaceState& surface, Index node, const Vec3& u) noexcept {
  if (surface.near.place_of(node) >= 0) return;
  const Vec3 position = unloaded_position(body, surface, node) + u;
  if (!position.allFinite()) return;
  const double squared = (position - surface.tree.position(node)).squaredNorm();
  if (squared == 0.0) return;
  if (squared > surface.sweep.change * surface.sweep.change) surface.sweep.change = std::sqrt(squared);
  surface.tree.move(node, position);
}

/// u of a surface node that the body's nodes give, as it was renewed last.
Vec3 stored_displacement(const Body& body, const SurfaceState& surface, Index node) noexcept {
  const SurfaceParts parts = body.surface_parts(node);
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < parts.stored.size(); ++k)
    sum += parts.weights[k] * vector_at(surface.stored_displacement, body.dimension(), parts.stored[k]);
  return sum;
}

}  // namespace

void move_near_surface(const Body& body, SurfaceState& surface) noexcept {
  for (Index place = 0; place < surface.near.count(); ++place) {
    const Index node = surface.near.node(place);
    if (body.aggregate_of(node) >= 0) continue;
    const Vec3 position = unloaded_position(body, surface, node) + surface.near.displacement(place);
    if (position.allFinite()) surface.tree.move(node, position);
  }
}

void follow_free_motion(const Body& body, State& state, Scratch& scratch) noexcept {
  SurfaceState& surface = state.surface;
  surface.motion.begin_tick(body);
  if (!surface.motion.active()) return;
  if (surface.motion.is_late()) state.status |= StepStatus::late_motion;
  move_near_surface(body, surface);
  const auto d = static_cast<std::size_t>(body.dimension());
  for (const ToolState& tool : state.tools) {
    if (!tool.placed) continue;
    const Core core = core_of(tool.tool, tool.pose, body.dimension());
    const double reach =
        tool.tool.radius + tool.margin + 2.0 * std::max(surface.sweep.last_change, surface.sweep.change);
    const std::size_t found =
        std::min(near_core(surface.tree, core, reach, scratch.found), scratch.pairs.size());
    for (std::size_t k = 0; k < found; ++k) {
      for (const Index node : body.simplices().subspan(d * static_cast<std::size_t>(scratch.found[k]), d)) {
        if (body.surface_moves(node)) move_far(body, surface, node, stored_displacement(body, surface, node));
      }
    }
  }
}

void renew_stored_displacement(const Body& body, SurfaceState& surface) noexcept {
  for (Index place = 0; place < surface.near.count(); ++place) {
    const auto node = static_cast<std::size_t>(surface.near.node(place));
    if (node >= body.surface_stored_nodes().size()) continue;
    set_vector(surface.stored_displacement, body.dimension(), body.surface_stored_nodes()[node],
               surface.near.displacement(place));
  }
}

void renew_far_surface(const Body& body, SurfaceState& surface, Scratch& scratch) noexcept {
  const int d = body.dimension();
  const SurfaceLoad& load = surface.near.load();
  const auto most = [&](Index budget) {
    return std::min(budget, tuning.far.blocks / std::max<Index>(load.count, 1) + 1);
  };
  const Index first = surface.sweep.next_node;
  const Index end = std::min(first + most(tuning.far.nodes), body.greens().nodes());
  const std::span<double> u(scratch.far_displacement.data(), static_cast<std::size_t>(d * (end - first)));
  body.greens().displacement(load.nodes(), load.forces(), first, u);
  std::copy(u.begin(), u.end(), surface.stored_displacement.begin() + std::ptrdiff_t{d} * first);
  Index moves = 0;
  Index stored = first;
  for (; stored < end && moves < tuning.far.moves; ++stored) {
    moves += static_cast<Index>(body.followers(stored).size());
    for (const Index node : body.followers(stored)) {
      if (surface.near.place_in_patch(node) >= 0) continue;
      move_far(body, surface, node, stored_displacement(body, surface, node));
    }
  }
  surface.sweep.next_node = stored % body.greens().nodes();
  if (surface.sweep.next_node != 0) return;
  surface.sweep.last_change = surface.sweep.change;
  surface.sweep.change = 0.0;
}

void renew_patch_surface(const Body& body, SurfaceState& surface, Scratch& scratch) noexcept {
  if (surface.near.patch() == nullptr) return;
  const std::span<const Index> nodes = surface.near.patch()->surface_nodes();
  const auto count = static_cast<Index>(nodes.size());
  surface.sweep.next_patch_node %= count;
  const Index end = std::min(surface.sweep.next_patch_node + tuning.far.patch_nodes, count);
  const std::span<double> u(
      scratch.far_displacement.data(),
      static_cast<std::size_t>(body.dimension() * (end - surface.sweep.next_patch_node)));
  patch_displacement(surface.near.load(), surface.sweep.next_patch_node, u);
  for (Index k = surface.sweep.next_patch_node; k < end; ++k)
    move_far(body, surface, nodes[k], vector_at(u, body.dimension(), k - surface.sweep.next_patch_node));
  surface.sweep.next_patch_node = end;
}

}  // namespace palpate
