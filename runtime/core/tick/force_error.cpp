#include "runtime/core/tick/force_error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/touch/touching_pair.h"

namespace palpate {
namespace {

void leave_out(const ElasticBody& body, const State& state, DetectionScratch& detection, LeftOut place,
               const std::array<Index, 3>& nodes, const std::array<double, 3>& weights) noexcept {
  if (static_cast<std::size_t>(detection.left_out_count) == detection.left_out.size()) return;
  place.node =
      nodes[static_cast<std::size_t>(std::max_element(weights.begin(), weights.end()) - weights.begin())];
  if (place.node < 0 || !body.surface_moves(place.node)) return;
  place.apart = state.tools[place.tool].pose.position - state.surface.tree.position(place.node);
  detection.left_out[detection.left_out_count++] = place;
}

/// Present depth of the tool there [m].
double depth_now(const State& state, const LeftOut& place) noexcept {
  const Vec3 apart = state.tools[place.tool].pose.position - state.surface.tree.position(place.node);
  return -(place.gap + place.normal.dot(apart - place.apart));
}

/// Stored node with the largest weight for a surface node.
Index stored_node(const ElasticBody& body, Index node) noexcept {
  const SurfaceParts parts = body.surface_parts(node);
  const auto most = std::max_element(parts.weights.begin(), parts.weights.end()) - parts.weights.begin();
  return parts.stored[static_cast<std::size_t>(most)];
}

double along(const Vec3& n, std::span<const double> block, std::ptrdiff_t stride, int d,
             const Vec3& m) noexcept {
  double sum = 0.0;
  for (int a = 0; a < d; ++a) {
    for (int b = 0; b < d; ++b) sum += n[a] * m[b] * block[static_cast<std::size_t>(a * stride + b)];
  }
  return sum;
}

/// Force that closes a place alone [N].
double closing_force(const ElasticBody& body, const State& state, const LeftOut& place,
                     double depth) noexcept {
  const Index node = stored_node(body, place.node);
  std::array<double, 9> block{};
  state.surface.near.load().greens(body).gather(node, {&node, 1}, block);
  const int d = body.dimension();
  const double give =
      along(place.normal, block, d, d, place.normal) + 1.0 / state.tools[place.tool].tool.coupling_stiffness;
  return depth / std::max(give, state.surface.least_compliance);
}

/// Places pressed by a tool.
struct Pressed {
  double contact_points = 0.0;
  std::size_t places = 0;
};

/// Visits these places if they are deeper than the penetration tolerated at contacts.
template <class Visit>
void for_each_pressed(const State& state, const DetectionScratch& detection, Index tool, double edge,
                      Visit&& visit) noexcept {
  const double least = tuning.passes.penetration * edge;
  for (Index k = 0; k < detection.left_out_count; ++k) {
    const LeftOut& place = detection.left_out[k];
    if (place.tool != tool) continue;
    const double depth = depth_now(state, place);
    if (depth > least) visit(place, depth);
  }
}

Pressed count_pressed(const State& state, const DetectionScratch& detection, Index tool,
                      double edge) noexcept {
  Pressed pressed;
  for_each_pressed(state, detection, tool, edge, [&](const LeftOut& place, double) {
    pressed.contact_points += place.contact_points;
    ++pressed.places;
  });
  return pressed;
}

/// Additional force on a tool by the places left out [N].
double missing_of_left_out(const ElasticBody& body, const State& state, Scratch& scratch, Index tool,
                           std::size_t places) noexcept {
  const std::size_t stride = (places + most_sampled - 1) / most_sampled;
  const int d = body.dimension();
  std::array<double, most_sampled> force;
  std::array<Vec3, most_sampled> normal;
  std::size_t seen = 0;
  std::size_t count = 0;
  Index deepest = -1;
  double depth_there = 0.0;
  for_each_pressed(
      state, scratch.detection, tool, body.mean_surface_edge(), [&](const LeftOut& place, double depth) {
        if (seen++ % stride != 0) return;
        scratch.force_error.left_out_nodes[count] = stored_node(body, place.node);
        force[count] =
            static_cast<double>(stride) * place.contact_points * closing_force(body, state, place, depth);
        normal[count] = place.normal;
        if (depth > depth_there) {
          depth_there = depth;
          deepest = static_cast<Index>(count);
        }
        ++count;
      });
  if (deepest < 0) return 0.0;
  const std::size_t row = static_cast<std::size_t>(deepest);
  const std::ptrdiff_t width = d * static_cast<std::ptrdiff_t>(count);
  const std::span<double> blocks(scratch.force_error.left_out_blocks.data(),
                                 static_cast<std::size_t>(d * width));
  state.surface.near.load().greens(body).gather(scratch.force_error.left_out_nodes[row],
                                                std::span(scratch.force_error.left_out_nodes).first(count),
                                                blocks);
  const double coupling = 1.0 / state.tools[tool].tool.coupling_stiffness;
  Vec3 sum = Vec3::Zero();
  double given_way = 0.0;
  for (std::size_t k = 0; k < count; ++k) {
    sum += force[k] * normal[k];
    given_way +=
        force[k] * (along(normal[row], blocks.subspan(static_cast<std::size_t>(d) * k), width, d, normal[k]) +
                    coupling * normal[row].dot(normal[k]));
  }
  return given_way > depth_there ? depth_there / given_way * sum.norm() : sum.norm();
}

}  // namespace

void leave_out_simplex(const ElasticBody& body, const State& state, DetectionScratch& detection, Index tool,
                       const Core& core, Index simplex) noexcept {
  const Tool& shape = state.tools[tool].tool;
  const SimplexNodes nodes = nodes_of(body, simplex);
  const NearestPoint nearest = touches_corners_alone(body, shape, simplex)
                                   ? nearest_corner(state.surface.tree, nodes, core)
                                   : nearest_points(state.surface.tree, nodes, core, has_point_core(shape));
  const double distance = std::sqrt(nearest.squared_distance);
  if (!(distance > 0.0 && distance < shape.radius)) return;
  leave_out(body, state, detection,
            {.tool = tool,
             .normal = (nearest.on_core - nearest.on_simplex) / distance,
             .gap = distance - shape.radius,
             .contact_points = 1.0 / (body.dimension() - 1)},
            nodes, nearest.weights);
}

void leave_out_contact(const ElasticBody& body, const State& state, DetectionScratch& detection,
                       const ContactPoint& contact) noexcept {
  leave_out(body, state, detection,
            {.tool = contact.tool, .normal = contact.frame.col(0), .gap = contact.gap}, contact.nodes,
            contact.weights);
}

void begin_force_error(Scratch& scratch) noexcept {
  std::fill(scratch.force_error.missing_force.begin(), scratch.force_error.missing_force.end(), Vec3::Zero());
  if (scratch.is_solved) return;
  scratch.force_error.imbalance.find(scratch.problem);
  for (Index i = 0; i < scratch.problem.rows; ++i) {
    const ContactRow& row = scratch.rows[i];
    if (row.tool >= 0)
      scratch.force_error.missing_force[row.tool] += scratch.force_error.imbalance.change()[i] * row.force;
  }
}

void note_answer(Scratch& scratch, Index tool, int axis, Index begin) noexcept {
  if (scratch.is_solved) return;
  double sum = 0.0;
  for (Index i = 0; i < scratch.problem.rows; ++i)
    sum += scratch.changes.of_forces[begin + i] * scratch.force_error.imbalance.motion()[i];
  scratch.force_error.missing_force[tool][axis] += sum;
}

void find_force_errors(const ElasticBody& body, State& state, Scratch& scratch) noexcept {
  for (std::size_t k = 0; k < state.tools.size(); ++k) {
    ToolState& tool = state.tools[k];
    const auto number = static_cast<Index>(k);
    tool.force_error = scratch.is_solved ? 0.0
                                         : scratch.solver.error(scratch.force_error.missing_force[k].norm(),
                                                                scratch.force_error.imbalance.residual());
    const Pressed pressed =
        tool.engaged ? count_pressed(state, scratch.detection, number, body.mean_surface_edge()) : Pressed{};
    tool.left_out = static_cast<Index>(std::ceil(pressed.contact_points));
    if (pressed.places > 0)
      tool.force_error +=
          tuning.hand.error_margin * missing_of_left_out(body, state, scratch, number, pressed.places);
    if (!std::isfinite(tool.force_error)) tool.force_error = tool.contact_wrench.force.norm();
  }
}

}  // namespace palpate
