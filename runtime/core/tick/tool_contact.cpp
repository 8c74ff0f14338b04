#include "runtime/core/tick/tool_contact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/touch/contact_feature.h"

namespace palpate {
namespace {

/// Returns the identifier of a vertex, edge or face and a place on the tool. Faces have the number of their
/// simplex, edges and vertices those of their nodes.
std::int64_t feature_of(Index tool, int place, Index simplex, bool face_tells, const SimplexNodes& nodes,
                        const std::array<double, 3>& weights) noexcept {
  std::array<Index, 3> used{};
  int count = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    if (weights[k] > 0.0) used[count++] = nodes[k];
  }
  if (face_tells || count == 3) return contact_feature(tool, place, FeatureKind::face, simplex);
  if (count == 1) return contact_feature(tool, place, FeatureKind::vertex, used[0]);
  return contact_feature(tool, place, FeatureKind::edge, used[0], used[1]);
}

Vec3 displacement_of(const ElasticBody& body, const NearField& near, const ContactPoint& contact) noexcept {
  Vec3 u = Vec3::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    if (contact.nodes[k] < 0 || !body.surface_moves(contact.nodes[k])) continue;
    u += contact.weights[k] * near.displacement(near.place_of(contact.nodes[k]));
  }
  return u;
}

/// Gradients of the nonzero barycentric weights, along the edge or face spanned by them.
std::array<Vec3, 3> slopes(const SurfaceTree& tree, const SimplexNodes& nodes) noexcept {
  std::array<Vec3, 3> slope{Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  std::array<std::size_t, 3> used{};
  std::size_t count = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    if (nodes[k] >= 0) used[count++] = k;
  }
  if (count == 2) {
    const Vec3 along = tree.position(nodes[used[1]]) - tree.position(nodes[used[0]]);
    const double squared = along.squaredNorm();
    if (squared > 0.0) slope[used[1]] = along / squared;
    slope[used[0]] = -slope[used[1]];
  } else if (count == 3) {
    const Vec3 ab = tree.position(nodes[1]) - tree.position(nodes[0]);
    const Vec3 ac = tree.position(nodes[2]) - tree.position(nodes[0]);
    const Vec3 normal = ab.cross(ac);
    const double squared = normal.squaredNorm();
    if (squared > 0.0) {
      slope[1] = ac.cross(normal) / squared;
      slope[2] = normal.cross(ab) / squared;
    }
    slope[0] = -slope[1] - slope[2];
  }
  return slope;
}

/// True if a candidate from `begin` on has the same position and normal. `vertex`: surface node at the
/// position; -1 if there is none. The first candidate of a node is compared only with those between nodes, as
/// no other can be equal.
bool is_duplicate(const ElasticBody& body, const DetectionScratch& detection, Index begin,
                  const Vec3& position, const Vec3& normal, Index vertex) noexcept {
  const double near = tuning.detection.same_place * body.mean_surface_edge();
  const auto is_same = [&](Index k) {
    const ContactPoint& other = detection.candidates[k];
    return k >= begin && (other.position - position).squaredNorm() < near * near &&
           other.frame.col(0).dot(normal) > 1.0 - tuning.detection.same_direction;
  };
  const Index at_node = vertex < 0 ? -1 : detection.candidate_at_node[vertex];
  const bool is_first = vertex >= 0 && (at_node < begin || at_node >= detection.candidate_count ||
                                        detection.candidates[at_node].position != position);
  if (is_first) {
    const auto between = detection.candidates_between.begin();
    return std::any_of(between, between + detection.between_count, is_same);
  }
  if (at_node >= 0 && is_same(at_node)) return true;
  for (Index k = begin; k < detection.candidate_count; ++k) {
    if (is_same(k)) return true;
  }
  return false;
}

/// Returns the surface node at a position; -1 if it is inside an edge or face.
Index vertex_of(const SimplexNodes& nodes, const std::array<double, 3>& weights) noexcept {
  for (std::size_t k = 0; k < 3; ++k) {
    if (weights[k] == 1.0) return nodes[k];
  }
  return -1;
}

/// True if a contact's normal rotates as the tool moves: at a vertex, and on an edge or face that carried
/// force.
bool rolls(const LastContacts& remembered, const Tool& tool, const ContactPoint& contact) noexcept {
  if (!has_point_core(tool) || contact.friction > 0.0) return false;
  if (std::count_if(contact.nodes.begin(), contact.nodes.end(), [](Index node) { return node >= 0; }) == 1)
    return true;
  const Index last = remembered.number_of(contact.feature);
  if (last < 0) return false;
  const ContactPoint& before = remembered.contacts[last];
  return before.force.dot(before.frame.col(0)) > 0.0;
}

/// Cosine of the angle by which a contact's normal is off the surface's, which has turned from where it was
/// at rest; on a crease, off that of the nearest of the faces around.
double inclination(const SurfaceLoad& load, Index node, const Vec3& normal) noexcept {
  const LocalCompliance::Point& point = load.local->point(node);
  const Vec3 turned = load.rotation(point) * point.normal;
  const double angle = std::acos(std::clamp(turned.dot(normal), -1.0, 1.0));
  return std::cos(std::max(0.0, angle - point.crease));
}

/// Friction with which a node is kept from slipping round the side of a tool, which the surface of a body of
/// small strain does once the tool is deeper than 1.3 of its radius; it would be lost inside. None where the
/// normal is within 45 degrees of the surface's at rest, which a sphere is up to 0.6 of its radius deep.
double holding_friction(double inclination) noexcept {
  const DetectionTuning& limits = tuning.detection;
  return std::clamp((limits.slips - inclination) / (limits.slips - limits.holds), 0.0, 1.0);
}

void add_candidate(const ElasticBody& body, State& state, Scratch& scratch, Index tool_number, Index begin,
                   const TouchingPair& pair, bool face_tells) noexcept {
  ToolState& tool = state.tools[tool_number];
  if (static_cast<std::size_t>(scratch.detection.candidate_count) == scratch.detection.candidates.size()) {
    tool.status |= StepStatus::capacity_full;
    return;
  }
  const Vec3 normal =
      face_tells ? pair.normal : Vec3((pair.nearest.on_core - pair.nearest.on_simplex) / pair.distance);
  const std::array<Index, 3> nodes = nodes_of(body, pair.simplex);
  const Index vertex = vertex_of(nodes, pair.nearest.weights);
  if (is_duplicate(body, scratch.detection, begin, pair.nearest.on_simplex, normal, vertex)) return;
  const bool is_fine = vertex >= 0 && body.local() != nullptr;
  const double inclined = is_fine ? inclination(state.surface.near.load(), vertex, normal) : 1.0;
  if (inclined < tuning.detection.holds) return;
  if (vertex >= 0) {
    scratch.detection.candidate_at_node[vertex] = scratch.detection.candidate_count;
  } else {
    scratch.detection.candidates_between[scratch.detection.between_count++] =
        scratch.detection.candidate_count;
  }
  ContactPoint contact;
  contact.feature =
      feature_of(tool_number, pair.place, pair.simplex, face_tells, nodes, pair.nearest.weights);
  contact.tool = tool_number;
  contact.simplex = pair.simplex;
  contact.weights = pair.nearest.weights;
  for (std::size_t k = 0; k < 3; ++k) contact.nodes[k] = contact.weights[k] > 0.0 ? nodes[k] : -1;
  contact.position = pair.nearest.on_simplex;
  contact.arm = contact.position - tool.pose.position;
  contact.slope = slopes(state.surface.tree, contact.nodes);
  contact.frame = contact_frame(normal, body.dimension());
  contact.gap = (face_tells ? pair.height : pair.distance) - tool.tool.radius;
  contact.friction = tool.tool.friction.value_or(body.surface_friction()[pair.simplex]);
  if (is_fine) contact.friction = std::max(contact.friction, holding_friction(inclined));
  contact.rolls = !face_tells && rolls(scratch.last, tool.tool, contact);
  contact.free_gap = contact.gap + normal.dot(device_motion(tool.pose, tool.device, contact.arm) +
                                              displacement_of(body, state.surface.near, contact));
  scratch.detection.candidates[scratch.detection.candidate_count++] = contact;
}

/// True if the simplex carried force at the same tool in the last tick or pass.
bool carried(const LastContacts& remembered, Index tool, const TouchingPair& pair) noexcept {
  const auto begin = remembered.contacts.begin();
  return std::any_of(begin, begin + remembered.count, [&](const ContactPoint& last) {
    return last.tool == tool && last.simplex == pair.simplex && !last.held && last.force.squaredNorm() > 0.0;
  });
}

/// True if a face points in the opposite direction from that at rest: a sharp tool can fold the surface over
/// itself, and would be caught between both sides by friction, at any pulling force.
bool has_turned_over(const ElasticBody& body, const TouchingPair& pair) noexcept {
  const SimplexNodes nodes = nodes_of(body, pair.simplex);
  const auto corner = [&](std::size_t k) { return body.surface_rest_positions()[nodes[k]]; };
  const Vec3 side = corner(1) - corner(0);
  const Vec3 normal = nodes[2] < 0 ? Vec3(side.y(), -side.x(), 0.0) : Vec3(side.cross(corner(2) - corner(0)));
  return normal.dot(pair.normal) < 0.0;
}

/// Adds a candidate for a pair that touches or may touch in this tick. From outside, a simplex is touched on
/// its outer side; those facing away are behind others. From slightly inside (rounding, or a fast tick), the
/// nearest ones and those that carried force push out along their normals.
void touch_pair(const ElasticBody& body, State& state, Scratch& scratch, const ToolContact& touch,
                const TouchingPair& pair) noexcept {
  const double radius = state.tools[touch.number].tool.radius;
  const bool pushes_out =
      pair.height < 0.0 && ((touch.inside && pair.distance <= 2.0 * touch.nearest_distance) ||
                            (carried(scratch.last, touch.number, pair) && pair.distance < touch.lost));
  const bool face_tells =
      pushes_out || pair.distance < tuning.detection.on_surface * body.mean_surface_edge();
  if (face_tells && has_turned_over(body, pair)) return;
  if (!face_tells && (pair.height < 0.0 || pair.distance - radius > touch.margin)) return;
  add_candidate(body, state, scratch, touch.number, touch.first_candidate, pair, face_tells);
}

/// True if a node already has the candidate of the core's origin, from another simplex.
bool is_found(const DetectionScratch& detection, const ToolContact& touch, const SurfaceTree& tree,
              Index node) noexcept {
  const Index k = detection.candidate_at_node[node];
  if (k < touch.first_candidate || k >= detection.candidate_count) return false;
  const ContactPoint& candidate = detection.candidates[k];
  if (candidate.position != tree.position(node)) return false;
  const Vec3 across = touch.core.origin - candidate.position;
  return candidate.frame.col(0).dot(across) > (1.0 - tuning.detection.same_direction) * across.norm();
}

/// Adds contact points of a triangle's edge: at the nearest point of the core and, for a disc, at its
/// crossings with the rim, since the nearest point of a flat edge switches between the ends of its part below
/// the disc.
void touch_edge(const ElasticBody& body, State& state, Scratch& scratch, const ToolContact& touch,
                const TouchingPair& seen, std::size_t corner) noexcept {
  const SurfaceTree& tree = state.surface.tree;
  const SimplexNodes nodes = nodes_of(body, seen.simplex);
  const TouchingPair edge = pair_of_edge(tree, nodes, seen, corner, touch.core);
  touch_pair(body, state, scratch, touch, edge);
  if (touch.core.disc_radius == 0.0) return;
  std::array<TouchingPair, 2> over_rim;
  const std::size_t count = pairs_over_rim(tree, nodes, seen, corner, touch.core, over_rim);
  const double apart = tuning.detection.rim_apart * body.simplex_edges()[seen.simplex];
  for (std::size_t k = 0; k < count; ++k) {
    const double squared = (over_rim[k].nearest.on_simplex - edge.nearest.on_simplex).squaredNorm();
    if (squared > apart * apart) touch_pair(body, state, scratch, touch, over_rim[k]);
  }
}

/// True for a pair of a disc's rim and the inside of a face that is flat below it: the nearest point then
/// switches along the rim, all of which is equally near. A pair that was a contact point may be flatter, so
/// that its own effect on the surface does not remove it.
bool is_flat_under_rim(const ElasticBody& body, const LastContacts& remembered, const ToolContact& touch,
                       const TouchingPair& pair) noexcept {
  if (touch.core.disc_radius == 0.0 || touch.inside || !is_within_face(pair) || pair.height <= 0.0 ||
      pair.distance <= tuning.detection.on_surface * body.mean_surface_edge())
    return false;
  const std::int64_t feature = contact_feature(touch.number, pair.place, FeatureKind::face, pair.simplex);
  const DetectionTuning& limits = tuning.detection;
  return pair.normal.cross(touch.core.axis).norm() <
         (remembered.number_of(feature) < 0 ? limits.steep : limits.still_steep);
}

/// Adds contact points around a disc's rim inside a face. A disc that is large relative to the triangle needs
/// none: its arc over the triangle is almost its chord, whose ends are at the edges.
void touch_rim(const ElasticBody& body, State& state, Scratch& scratch, const ToolContact& touch,
               Index simplex) noexcept {
  if (touch.core.disc_radius > tuning.detection.large_disc * body.simplex_edges()[simplex]) return;
  for (int place = 0; place < places_on_rim; ++place) {
    const TouchingPair pair = pair_on_rim(body, state.surface.tree, simplex, touch.core, place);
    if (is_within_face(pair)) touch_pair(body, state, scratch, touch, pair);
  }
}

/// True if the core's origin adds no candidate at a node: it is out of reach, or has it already.
bool is_done(const DetectionScratch& detection, const ToolContact& touch, const SurfaceTree& tree,
             double reach, Index node) noexcept {
  return (touch.core.origin - tree.position(node)).squaredNorm() > reach * reach ||
         is_found(detection, touch, tree, node);
}

/// Parts of a simplex that are contact points beside its nearest point: corners seen from the core's origin
/// or from all of it, and edges.
enum class Parts : std::uint8_t { corners, corners_of_core, corners_and_edges };

/// Adds all corners as contact points below a segment, disc or large sphere, and for disc and segment the
/// edges: relative to a flat surface the single nearest point would switch between sides.
void touch_corners(const ElasticBody& body, State& state, Scratch& scratch, const ToolContact& touch,
                   const TouchingPair& seen, Parts parts) noexcept {
  const SurfaceTree& tree = state.surface.tree;
  const SimplexNodes nodes = nodes_of(body, seen.simplex);
  const std::size_t corners = body.dimension() == 2 ? 2 : 3;
  const bool seen_from_outside = seen.height >= 0.0 && !touch.inside;
  const double reach = state.tools[touch.number].tool.radius + touch.margin;
  for (std::size_t n = 0; n < corners; ++n) {
    const int place = parts == Parts::corners ? 0 : 2;
    if (parts == Parts::corners && seen_from_outside &&
        is_done(scratch.detection, touch, tree, reach, nodes[n]))
      continue;
    touch_pair(body, state, scratch, touch, pair_of_corner(tree, nodes, seen, n, touch.core, place));
    if (parts == Parts::corners_and_edges && corners == 3) touch_edge(body, state, scratch, touch, seen, n);
  }
}

/// Adds the contact points of a sphere with a simplex that it touches at its corners only. Between the nodes
/// the surface is smooth: its triangles are chords that are small relative to the sphere, and would keep it
/// out by edge^2 / 6 R. From outside and not deep, most simplices have no corner left that others have not
/// added.
void touch_chord(const ElasticBody& body, State& state, Scratch& scratch, const ToolContact& touch,
                 const TouchingPair& nearest) noexcept {
  const SurfaceTree& tree = state.surface.tree;
  const SimplexNodes nodes = nodes_of(body, nearest.simplex);
  const double reach = state.tools[touch.number].tool.radius + touch.margin;
  if (nearest.distance > reach) return;
  if (!touch.inside && touch.nearest_distance >= touch.lost &&
      std::all_of(nodes.begin(), nodes.end(), [&](Index node) {
        return node < 0 || is_done(scratch.detection, touch, tree, reach, node);
      }))
    return;
  TouchingPair pair = nearest;
  find_height(tree, nodes, pair);
  touch_corners(body, state, scratch, touch, pair, Parts::corners);
}

/// True if a capsule needs no more of a simplex than its corners: the simplex is a small part of a fine
/// surface (LocalCompliance).
bool is_smooth_for(const ElasticBody& body, const Tool& tool, Index simplex) noexcept {
  return body.local() != nullptr &&
         tool.radius > tuning.detection.smooth_radius * body.simplex_edges()[simplex];
}

}  // namespace

void touch_simplex(const ElasticBody& body, State& state, Scratch& scratch, const ToolContact& touch,
                   const TouchingPair& nearest) noexcept {
  const Tool& tool = state.tools[touch.number].tool;
  const SurfaceTree& tree = state.surface.tree;
  const Index simplex = nearest.simplex;
  if (touches_corners_alone(body, tool, simplex)) return touch_chord(body, state, scratch, touch, nearest);
  TouchingPair pair = nearest;
  const bool is_disc = touch.core.disc_radius > 0.0;
  const bool is_extended = !has_point_core(tool);
  if (is_extended && !is_disc && !touch.inside && is_smooth_for(body, tool, simplex))
    return touch_corners(body, state, scratch, touch, pair, Parts::corners_of_core);
  // The centre of a disc is no special point, except when it has to be pushed out.
  if (!is_disc || touch.inside) touch_pair(body, state, scratch, touch, pair);
  if (is_extended) {
    if (!is_disc) touch_pair(body, state, scratch, touch, pair_of_end(body, tree, simplex, touch.core, 1));
    pair = pair_of_core(body, tree, simplex, touch.core);
    if (!is_flat_under_rim(body, scratch.last, touch, pair)) touch_pair(body, state, scratch, touch, pair);
  }
  const bool is_flat = is_extended || tool.radius > body.mean_surface_edge();
  if (!is_flat || pair.distance - tool.radius > touch.margin) return;
  touch_corners(body, state, scratch, touch, pair, is_extended ? Parts::corners_and_edges : Parts::corners);
  if (is_disc) touch_rim(body, state, scratch, touch, simplex);
}

}  // namespace palpate
