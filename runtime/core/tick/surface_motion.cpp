#include "runtime/core/tick/surface_motion.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/vectors.h"
#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/touch/touching_pair.h"

namespace palpate {
namespace {

constexpr std::size_t most_ranges = 256;  // ranges of near runs updated in one tick

/// Moves a surface node that is not near a tool.
void move_far(const ElasticBody& body, SurfaceState& surface, Index node, const Vec3& u) noexcept {
  if (surface.near.place_of(node) >= 0) return;
  const Vec3 position = unloaded_position(body, surface, node) + u;
  if (!position.allFinite()) return;
  const double squared = (position - surface.tree.position(node)).squaredNorm();
  if (squared == 0.0) return;
  if (squared > surface.sweep.change * surface.sweep.change) surface.sweep.change = std::sqrt(squared);
  surface.tree.move(node, position);
}

/// Displacement u of a surface node from the body's nodes, as of their last update.
Vec3 stored_displacement(const ElasticBody& body, const SurfaceState& surface, Index node) noexcept {
  const SurfaceParts parts = body.surface_parts(node);
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < parts.stored.size(); ++k)
    sum += parts.weights[k] * vector_at(surface.stored_displacement, body.dimension(), parts.stored[k]);
  return sum + surface.near.load().far_local_displacement(node);
}

/// Moves a surface node that is not near a tool with the body. Where it has a local compliance only by the
/// motion's change: its displacement by forces is as of its last update, and takes long.
void follow_motion(const ElasticBody& body, SurfaceState& surface, Index node) noexcept {
  if (surface.near.load().local_now() == nullptr) {
    move_far(body, surface, node, stored_displacement(body, surface, node));
  } else if (surface.near.place_of(node) < 0) {
    const Vec3 position = surface.tree.position(node) + surface.motion.advance(body, node);
    if (position.allFinite()) surface.tree.move(node, position);
  }
}

/// Computes the displacement of ranges of stored nodes by the near field's load.
void displace_ranges(const ElasticBody& body, const SurfaceState& surface, std::span<double> room,
                     std::span<const NodeRange> ranges) noexcept {
  std::size_t nodes = 0;
  for (const NodeRange& range : ranges) nodes += static_cast<std::size_t>(range.end - range.first);
  const SurfaceLoad& load = surface.near.load();
  load.greens(body).displacement(load.nodes(), load.forces(), ranges,
                                 room.first(static_cast<std::size_t>(body.dimension()) * nodes));
}

/// Updates the displacement of stored nodes [first, end) to u, and moves the surface nodes that follow them
/// until `moves` is used up; returns the end of the updated nodes.
Index renew_nodes(const ElasticBody& body, SurfaceState& surface, const double* u, Index first, Index end,
                  Index& moves) noexcept {
  const int d = body.dimension();
  std::copy_n(u, d * (end - first), surface.stored_displacement.begin() + std::ptrdiff_t{d} * first);
  Index stored = first;
  for (; stored < end && moves > 0; ++stored) {
    moves -= static_cast<Index>(body.followers(stored).size());
    for (const Index node : body.followers(stored)) {
      if (surface.near.place_in_patch(node) >= 0) continue;
      move_far(body, surface, node, stored_displacement(body, surface, node));
    }
  }
  return stored;
}

/// Fills sweep.near_runs: the runs of stored nodes that are near, and those beside them.
void find_near_runs(const ElasticBody& body, const NearField& near, FarSweep& sweep) noexcept {
  const NodeRuns& runs = body.runs();
  std::fill(sweep.runs.begin(), sweep.runs.end(), RunPlace::far);
  for (Index place = 0; place < near.count(); ++place) {
    const auto node = static_cast<std::size_t>(near.node(place));
    if (node < body.surface_stored_nodes().size())
      sweep.runs[runs.of(body.surface_stored_nodes()[node])] = RunPlace::near;
  }
  for (Index run = 0; run < runs.count(); ++run) {
    if (sweep.runs[run] != RunPlace::near) continue;
    for (const Index other : runs.beside(run)) {
      if (sweep.runs[other] == RunPlace::far) sweep.runs[other] = RunPlace::beside;
    }
  }
  sweep.near_run_count = 0;
  for (Index run = 0; run < runs.count(); ++run) {
    if (sweep.runs[run] != RunPlace::far) sweep.near_runs[sweep.near_run_count++] = run;
  }
}

/// Updates up to `most` nodes of the near runs, in turn, each at most once. False if there are none.
bool renew_near_runs(const ElasticBody& body, SurfaceState& surface, std::span<double> room,
                     Index most) noexcept {
  const NodeRuns& runs = body.runs();
  FarSweep& sweep = surface.sweep;
  if (sweep.next_near_run >= sweep.near_run_count) {
    find_near_runs(body, surface.near, sweep);
    sweep.next_near_run = 0;
  }
  if (sweep.near_run_count == 0) return false;
  std::array<NodeRange, most_ranges> ranges;
  std::size_t count = 0;
  for (Index left = most, run = sweep.next_near_run, done = sweep.done_of_run;
       left > 0 && run < sweep.near_run_count && count < ranges.size(); ++run, done = 0) {
    const Index begin = runs.begin(sweep.near_runs[run]) + done, end = runs.end(sweep.near_runs[run]);
    ranges[count++] = {begin, end};
    left -= end - begin;
  }
  displace_ranges(body, surface, room, std::span(ranges).first(count));
  Index moves = tuning.far.moves;
  const double* u = room.data();
  for (std::size_t k = 0; k < count && moves > 0; ++k) {
    const auto [begin, end] = ranges[k];
    const Index run = sweep.near_runs[sweep.next_near_run];
    const Index stopped = renew_nodes(body, surface, u, begin, end, moves);
    u += std::ptrdiff_t{body.dimension()} * (end - begin);
    sweep.done_of_run = stopped - runs.begin(run);
    if (stopped < end) break;
    sweep.done_of_run = 0;
    ++sweep.next_near_run;
  }
  return true;
}

/// Updates the next `most` nodes of the whole body.
void renew_all_in_turn(const ElasticBody& body, SurfaceState& surface, std::span<double> room,
                       Index most) noexcept {
  FarSweep& sweep = surface.sweep;
  const Index nodes = body.greens().nodes();
  Index moves = tuning.far.moves;
  const Index end = std::min(sweep.next_node + most, nodes);
  const NodeRange range{sweep.next_node, end};
  displace_ranges(body, surface, room, {&range, 1});
  sweep.next_node = renew_nodes(body, surface, room.data(), sweep.next_node, end, moves) % nodes;
  if (sweep.next_node != 0) return;
  sweep.last_change = sweep.change;
  sweep.change = 0.0;
}

/// Largest change of a near node's displacement by the body's own motion in this tick [m].
double near_motion(const ElasticBody& body, const SurfaceState& surface) noexcept {
  double largest = 0.0;
  for (Index place = 0; place < surface.near.count(); ++place) {
    const Index node = surface.near.node(place);
    if (body.aggregate_of(node) < 0) largest = std::max(largest, surface.motion.change(node).norm());
  }
  return largest;
}

}  // namespace

void change_compliance(const ElasticBody& body, SurfaceState& surface,
                       const std::shared_ptr<const Greens>& compliance,
                       std::span<const double> shift) noexcept {
  const SurfaceLoad& load = surface.near.load();
  if (load.compliance == compliance) return;
  std::vector<double>& u = surface.stored_displacement;
  if (shift.empty()) {
    load.greens(body).displacement(load.nodes(), load.forces(), u);
    surface.motion.take_over(body, u, 1.0);
    surface.near.change_compliance(body, compliance);
    load.greens(body).displacement(load.nodes(), load.forces(), u);
    surface.motion.take_over(body, u, -1.0);
    return;
  }
  // Near nodes by the forces now, others as the job's forces moved them.
  const auto d = static_cast<std::size_t>(body.dimension());
  ComplianceChange& change = surface.change;
  const std::size_t count = surface.near.followed().size();
  for (std::size_t k = 0; k < count; ++k)
    change.range[k] = {surface.near.followed()[k], surface.near.followed()[k] + 1};
  const auto look = [&](std::vector<double>& at) {
    load.greens(body).displacement(load.nodes(), load.forces(), std::span(change.range).first(count),
                                   std::span(at).first(d * count));
  };
  look(change.before);
  surface.near.change_compliance(body, compliance);
  look(change.after);
  std::copy(shift.begin(), shift.end(), change.of_all.begin());
  for (std::size_t k = 0; k < d * count; ++k) {
    const std::size_t dof = d * static_cast<std::size_t>(change.range[k / d].first) + k % d;
    change.of_all[dof] = change.before[k] - change.after[k];
  }
  surface.motion.take_over(body, change.of_all, 1.0);
  for (std::size_t dof = 0; dof < u.size(); ++dof) u[dof] -= change.of_all[dof];
}

void move_near_surface(const ElasticBody& body, SurfaceState& surface) noexcept {
  for (Index place = 0; place < surface.near.count(); ++place) {
    const Index node = surface.near.node(place);
    if (body.aggregate_of(node) >= 0) continue;
    const Vec3 position = unloaded_position(body, surface, node) + surface.near.displacement(place);
    if (position.allFinite()) surface.tree.move(node, position);
  }
  surface.tree.refit();
}

void follow_free_motion(const ElasticBody& body, State& state, DetectionScratch& detection) noexcept {
  SurfaceState& surface = state.surface;
  surface.motion.begin_tick(body);
  surface.own_motion = 0.0;
  if (!surface.motion.active()) return;
  const bool is_behind = surface.motion.job().step > surface.motion.sample_step() + 1;  // by whole steps
  if (is_behind || surface.motion.is_late()) state.status |= StepStatus::late_motion;
  move_near_surface(body, surface);
  surface.own_motion = near_motion(body, surface);
  surface.unfollowed += surface.motion.most_change();
  if (surface.unfollowed <= tuning.far.unfollowed * body.mean_surface_edge()) return;
  surface.unfollowed = 0.0;
  const auto d = static_cast<std::size_t>(body.dimension());
  for (const ToolState& tool : state.tools) {
    if (!tool.placed) continue;
    const Core core = core_of(tool.tool, tool.pose, body.dimension());
    const double reach =
        tool.tool.radius + tool.margin + 2.0 * std::max(surface.sweep.last_change, surface.sweep.change);
    const std::size_t found =
        std::min(near_core(surface.tree, core, reach, detection.found), detection.pairs.size());
    for (std::size_t k = 0; k < found; ++k) {
      for (const Index node : body.simplices().subspan(d * static_cast<std::size_t>(detection.found[k]), d)) {
        if (body.surface_moves(node)) follow_motion(body, surface, node);
      }
    }
    surface.tree.refit();
  }
}

void renew_stored_displacement(const ElasticBody& body, SurfaceState& surface) noexcept {
  if (surface.near.load().local_now() != nullptr) return;  // near nodes move by the local compliance too
  for (Index place = 0; place < surface.near.count(); ++place) {
    const auto node = static_cast<std::size_t>(surface.near.node(place));
    if (node >= body.surface_stored_nodes().size()) continue;
    set_vector(surface.stored_displacement, body.dimension(), body.surface_stored_nodes()[node],
               surface.near.displacement(place));
  }
}

void renew_far_surface(const ElasticBody& body, SurfaceState& surface, std::span<double> room,
                       std::int64_t tick) noexcept {
  const Index most =
      std::min(tuning.far.nodes, tuning.far.blocks / std::max<Index>(surface.near.load().count, 1) + 1);
  const bool is_turn_of_near = tick % tuning.far.all_stride != 0;
  if (is_turn_of_near && renew_near_runs(body, surface, room, most)) return;
  renew_all_in_turn(body, surface, room, most);
}

void renew_patch_surface(const ElasticBody& body, SurfaceState& surface, std::span<double> room) noexcept {
  if (surface.near.patch() == nullptr) return;
  const std::span<const Index> nodes = surface.near.patch()->surface_nodes();
  const auto count = static_cast<Index>(nodes.size());
  surface.sweep.next_patch_node %= count;
  const Index end = std::min(surface.sweep.next_patch_node + tuning.far.patch_nodes, count);
  const std::span<double> u(
      room.data(), static_cast<std::size_t>(body.dimension() * (end - surface.sweep.next_patch_node)));
  patch_displacement(surface.near.load(), surface.sweep.next_patch_node, u);
  for (Index k = surface.sweep.next_patch_node; k < end; ++k)
    move_far(body, surface, nodes[k], vector_at(u, body.dimension(), k - surface.sweep.next_patch_node));
  surface.sweep.next_patch_node = end;
}

}  // namespace palpate
