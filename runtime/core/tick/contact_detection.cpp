#include "runtime/core/tick/contact_detection.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/tick/contact_merging.h"
#include "runtime/core/tick/force_error.h"
#include "runtime/core/tick/rolling.h"
#include "runtime/core/touch/contact_feature.h"
#include "runtime/core/touch/contact_nodes.h"

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

/// Adds the nodes of a simplex to the near field, at their present positions in the tree; sets `moved` if the
/// tree had one elsewhere.
bool want_nodes(const ElasticBody& body, SurfaceState& surface, const SimplexNodes& nodes,
                bool& moved) noexcept {
  bool room = true;
  for (const Index node : nodes) {
    if (node < 0 || surface.near.is_wanted(node) || !body.surface_moves(node)) continue;
    if (!surface.near.want(body, node)) {
      room = false;
      continue;
    }
    const Vec3 position =
        unloaded_position(body, surface, node) + surface.near.displacement(surface.near.place_of(node));
    if (position == surface.tree.position(node)) continue;
    surface.tree.move(node, position);
    moved = true;
  }
  return room;
}

/// Returns a movable node of a simplex that is not in the near field; -1 if there is none.
Index far_node_of(const ElasticBody& body, const NearField& near, const SimplexNodes& nodes) noexcept {
  const auto far = std::find_if(nodes.begin(), nodes.end(), [&](Index node) {
    return node >= 0 && body.surface_moves(node) && near.place_of(node) < 0;
  });
  return far == nodes.end() ? -1 : *far;
}

/// Adds one node to the near field that will soon be wanted, as adding many in one tick takes long.
void want_ahead(const ElasticBody& body, SurfaceState& surface, const DetectionScratch& detection) noexcept {
  if (detection.simplex_ahead < 0 || surface.near.count() == surface.near.capacity()) return;
  const Index node = far_node_of(body, surface.near, nodes_of(body, detection.simplex_ahead));
  bool moved = false;
  want_nodes(body, surface, {node, -1, -1}, moved);
  surface.tree.refit();
}

/// Nearest point of a simplex that a sphere touches at its corners only: the nearest corner if the sphere's
/// centre is far away.
NearestPoint nearest_of_chord(const SurfaceTree& tree, const SimplexNodes& nodes, const Core& core,
                              double radius) noexcept {
  const NearestPoint corner = nearest_corner(tree, nodes, core);
  const double far = 0.5 * radius;
  return corner.squared_distance > far * far ? corner : nearest_points(tree, nodes, core, true);
}

/// Finds the simplices nearest to the tool in the tree, at most as many as may be examined: fills
/// scratch.detection.found and `nearest` of scratch.detection.pairs, and returns their number.
std::size_t nearest_simplices(const ElasticBody& body, const SurfaceState& surface, Scratch& scratch,
                              ToolState& tool, const Core& core, double reach) noexcept {
  const SurfaceTree& tree = surface.tree;
  const double ahead = reach + tuning.detection.ahead * body.mean_surface_edge();
  const std::size_t all = near_core(tree, core, ahead, scratch.detection.found);
  const bool is_point = has_point_core(tool.tool);
  double nearest_ahead = ahead * ahead;
  scratch.detection.simplex_ahead = -1;
  std::size_t count = 0;
  for (std::size_t k = 0; k < std::min(all, scratch.detection.found.size()); ++k) {
    const Index simplex = scratch.detection.found[k];
    const SimplexNodes nodes = nodes_of(body, simplex);
    const NearestPoint nearest = touches_corners_alone(body, tool.tool, simplex)
                                     ? nearest_of_chord(tree, nodes, core, tool.tool.radius)
                                     : nearest_points(tree, nodes, core, is_point);
    if (nearest.squared_distance > reach * reach) {
      if (nearest.squared_distance < nearest_ahead && far_node_of(body, surface.near, nodes) >= 0) {
        nearest_ahead = nearest.squared_distance;
        scratch.detection.simplex_ahead = simplex;
      }
      continue;
    }
    scratch.detection.found[count] = simplex;
    scratch.detection.found_distance[simplex] = nearest.squared_distance;
    if (count < scratch.detection.pairs.size()) scratch.detection.pairs[count].nearest = nearest;
    ++count;
  }
  scratch.high_water.simplices = std::max(scratch.high_water.simplices, static_cast<Index>(count));
  if (all > scratch.detection.found.size()) tool.status |= StepStatus::capacity_full;
  scratch.detection.found_count = count;
  if (count > scratch.detection.pairs.size()) {
    tool.status |= StepStatus::capacity_full;
    const auto nearer = [&](Index a, Index b) {
      const double da = scratch.detection.found_distance[a];
      const double db = scratch.detection.found_distance[b];
      return da < db || (da == db && a < b);
    };
    std::nth_element(
        scratch.detection.found.begin(),
        scratch.detection.found.begin() + static_cast<std::ptrdiff_t>(scratch.detection.pairs.size()),
        scratch.detection.found.begin() + static_cast<std::ptrdiff_t>(count), nearer);
    count = scratch.detection.pairs.size();
  }
  return count;
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

/// True if a grab of the tool holds a node of a simplex: the tool does not press there as well, since both
/// would act as levers against each other. This does not depend on how the surface is deformed.
bool is_held(const ElasticBody& body, const State& state, Index tool, const SimplexNodes& nodes) noexcept {
  const auto begin = state.contact_points.begin();
  return std::any_of(begin, begin + state.held_count, [&](const ContactPoint& held) {
    bool shares_node = false;
    for_each_node(body, state.surface.near, held, [&](Index node, double) {
      shares_node = shares_node || std::find(nodes.begin(), nodes.end(), node) != nodes.end();
    });
    return held.tool == tool && shares_node;
  });
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

/// Contact of one tool with the surface in this tick.
struct ToolContact {
  Index number;  // number of the tool
  Core core;
  double margin;          // [m]
  double lost;            // [m] depth at which a core is lost in the body
  Index usable = 0;       // simplices of scratch.detection.found whose nodes are in the near field
  bool is_known = true;   // scratch.detection.pairs have the nearest points of the core's origin
  Index first_candidate;  // first candidate of this tool
  double nearest_distance = std::numeric_limits<double>::infinity();  // [m] from the core's origin
  bool inside = false;  // the core's origin is behind the surface
};

/// Keeps those of `count` simplices whose nodes fit into the near field.
void keep_usable(const ElasticBody& body, State& state, DetectionScratch& detection, ToolContact& touch,
                 std::size_t count) noexcept {
  bool moved = false;
  for (std::size_t k = 0; k < count; ++k) {
    const Index simplex = detection.found[k];
    if (!want_nodes(body, state.surface, nodes_of(body, simplex), moved)) {
      state.tools[touch.number].status |= StepStatus::capacity_full;
      leave_out_simplex(body, state, detection, touch.number, touch.core, simplex);
      continue;
    }
    detection.pairs[touch.usable].nearest = detection.pairs[k].nearest;
    detection.found[touch.usable++] = simplex;
  }
  state.surface.tree.refit();
  touch.is_known = touch.is_known && !moved;
}

/// Computes the pair of the core's origin. For a simplex touched at its corners only, normal and height are
/// omitted, since few of these are needed.
void look_at(const ElasticBody& body, const SurfaceTree& tree, const Tool& tool, const ToolContact& touch,
             Index simplex, TouchingPair& pair) noexcept {
  const bool is_chord = touches_corners_alone(body, tool, simplex);
  if (!is_chord && !touch.is_known) {
    pair = pair_of_end(body, tree, simplex, touch.core, 0);
    return;
  }
  const SimplexNodes nodes = nodes_of(body, simplex);
  pair.simplex = simplex;
  pair.place = 0;
  if (!touch.is_known) pair.nearest = nearest_of_chord(tree, nodes, touch.core, tool.radius);
  pair.distance = std::sqrt(pair.nearest.squared_distance);
  if (!is_chord) find_height(tree, nodes, pair);
}

/// Computes the pairs of the core's origin, and the side of the nearest simplices on which it lies.
void look_from_origin(const ElasticBody& body, const SurfaceTree& tree, const Tool& tool,
                      DetectionScratch& detection, ToolContact& touch) noexcept {
  for (Index k = 0; k < touch.usable; ++k) {
    look_at(body, tree, tool, touch, detection.found[k], detection.pairs[k]);
    touch.nearest_distance = std::min(touch.nearest_distance, detection.pairs[k].distance);
  }
  const double as_near = touch.nearest_distance + tuning.detection.on_surface * body.mean_surface_edge();
  double side = 0.0;
  for (Index k = 0; k < touch.usable; ++k) {
    TouchingPair& pair = detection.pairs[k];
    if (pair.distance > as_near) continue;
    find_height(tree, nodes_of(body, pair.simplex), pair);
    side += pair.height;
  }
  touch.inside = side < 0.0;
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

/// Adds all corners as contact points below a segment, disc or large sphere, and for segment and disc the
/// edges: relative to a flat surface the single nearest point would switch between sides.
void touch_corners(const ElasticBody& body, State& state, Scratch& scratch, const ToolContact& touch,
                   const TouchingPair& seen, bool is_extended) noexcept {
  const SurfaceTree& tree = state.surface.tree;
  const SimplexNodes nodes = nodes_of(body, seen.simplex);
  const std::size_t corners = body.dimension() == 2 ? 2 : 3;
  const bool seen_from_outside = seen.height >= 0.0 && !touch.inside;
  const double reach = state.tools[touch.number].tool.radius + touch.margin;
  for (std::size_t n = 0; n < corners; ++n) {
    const int place = is_extended ? 2 : 0;
    if (!is_extended && seen_from_outside && is_done(scratch.detection, touch, tree, reach, nodes[n]))
      continue;
    touch_pair(body, state, scratch, touch, pair_of_corner(tree, nodes, seen, n, touch.core, place));
    if (is_extended && corners == 3) touch_edge(body, state, scratch, touch, seen, n);
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
  touch_corners(body, state, scratch, touch, pair, false);
}

/// Adds the contact points of one tool with one simplex.
void touch_simplex(const ElasticBody& body, State& state, Scratch& scratch, const ToolContact& touch,
                   const TouchingPair& nearest) noexcept {
  const Tool& tool = state.tools[touch.number].tool;
  const SurfaceTree& tree = state.surface.tree;
  const Index simplex = nearest.simplex;
  if (touches_corners_alone(body, tool, simplex)) return touch_chord(body, state, scratch, touch, nearest);
  TouchingPair pair = nearest;
  const bool is_disc = touch.core.disc_radius > 0.0;
  const bool is_extended = !has_point_core(tool);
  // The centre of a disc is no special point, except when it has to be pushed out.
  if (!is_disc || touch.inside) touch_pair(body, state, scratch, touch, pair);
  if (is_extended) {
    if (!is_disc) touch_pair(body, state, scratch, touch, pair_of_end(body, tree, simplex, touch.core, 1));
    pair = pair_of_core(body, tree, simplex, touch.core);
    if (!is_flat_under_rim(body, scratch.last, touch, pair)) touch_pair(body, state, scratch, touch, pair);
  }
  const bool is_flat = is_extended || tool.radius > body.mean_surface_edge();
  if (!is_flat || pair.distance - tool.radius > touch.margin) return;
  touch_corners(body, state, scratch, touch, pair, is_extended);
  if (is_disc) touch_rim(body, state, scratch, touch, simplex);
}

/// Fraction of the surface's motion in the last tick that is expected in this one, from the motion of the
/// device.
double going_on(const ToolState& tool) noexcept {
  const double squared = tool.last_motion.squaredNorm();
  if (squared == 0.0) return 0.0;
  const Vec3 motion = tool.device.position - tool.last_device.position;
  return std::clamp(motion.dot(tool.last_motion) / squared, 0.0, 1.0);
}

/// Motion of the surface at a contact point in the last tick [m].
Vec3 last_motion(const ElasticBody& body, const NearField& near, const ContactPoint& contact) noexcept {
  Vec3 motion = Vec3::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    if (contact.nodes[k] < 0 || !body.surface_moves(contact.nodes[k])) continue;
    motion += contact.weights[k] * near.last_motion(near.place_of(contact.nodes[k]));
  }
  return motion;
}

/// Motion with the device in this tick of the core's point above a contact point [m], without that along the
/// axis of a capsule, which has no effect.
Vec3 core_motion(const ToolState& tool, const Core& core, const ContactPoint& contact) noexcept {
  if (tool.tool.length == 0.0) return tool.device.position - tool.last_device.position;
  const Vec3 arm = contact.arm + (contact.gap + tool.tool.radius) * contact.frame.col(0);
  const Vec3 motion = device_motion(tool.last_device, tool.device, arm);
  const Vec3 axis = core.end - core.origin;
  const double share = axis.dot(arm) / axis.squaredNorm();
  const double end = tuning.detection.same_place;
  return share > end && share < 1.0 - end ? Vec3(motion - motion.dot(axis) / axis.squaredNorm() * axis)
                                          : motion;
}

/// True if a tool is so blunt that the normal at a node rotates little as it passes over it. Over the flat
/// side of a disc it does not rotate at all.
bool is_blunt(const ElasticBody& body, const Tool& tool) noexcept {
  return tool.disc_radius <= tool.radius &&
         tool.radius >= tuning.assembly.least_tilt_radius * body.mean_surface_edge();
}

/// Rotates the normals of contacts in advance, by the device's motion in the tick. This is done after all are
/// found, since equal positions are recognised by their present normals.
void turn_ahead(const ElasticBody& body, const NearField& near, const ToolState& tool, const Core& core,
                DetectionScratch& detection, Index begin) noexcept {
  if (tool.device.position == tool.last_device.position &&
      tool.device.orientation.coeffs() == tool.last_device.orientation.coeffs())
    return;
  const double radius = rolling_radius(tool.tool, body.mean_surface_edge());
  const bool blunt = is_blunt(body, tool.tool);
  const double share = going_on(tool);
  for (Index k = begin; k < detection.candidate_count; ++k) {
    ContactPoint& contact = detection.candidates[k];
    if (!contact.rolls && !(blunt && kind_of(contact.feature) == FeatureKind::vertex)) continue;
    const Vec3 normal = contact.frame.col(0);
    const Vec3 foreseen = core_motion(tool, core, contact) - share * last_motion(body, near, contact);
    const Vec3 turned = rolled_normal(normal, foreseen, radius);
    const double nearer = (1.0 - turned.dot(normal)) * (contact.gap + tool.tool.radius);
    contact.frame = contact_frame(turned, body.dimension());
    contact.gap -= nearer;
    contact.free_gap -= nearer;
  }
}

/// True if the core is so deep in the body that no simplex would push it out on the side where it entered.
bool is_lost(const ElasticBody& body, const SurfaceTree& tree, const ToolContact& touch) noexcept {
  if (touch.usable > 0) return touch.inside && touch.nearest_distance > touch.lost;
  return body.bounds().contains(touch.core.origin) && tree.inside(touch.core.origin);
}

/// Finds the contact points of one tool.
void find_candidates(const ElasticBody& body, State& state, Scratch& scratch, Index number) noexcept {
  ToolState& tool = state.tools[number];
  ToolContact touch{.number = number,
                    .core = core_of(tool.tool, tool.pose, body.dimension()),
                    .margin = tool.margin,
                    .lost = tuning.detection.deepest_inside * body.mean_surface_edge(),
                    .first_candidate = scratch.detection.candidate_count};
  const double reach = std::max(tool.tool.radius + touch.margin, touch.lost);
  const std::size_t count = nearest_simplices(body, state.surface, scratch, tool, touch.core, reach);
  touch.is_known = has_point_core(tool.tool) && count < scratch.detection.pairs.size();
  for (std::size_t k = count; k < scratch.detection.found_count; ++k)
    leave_out_simplex(body, state, scratch.detection, number, touch.core, scratch.detection.found[k]);
  keep_usable(body, state, scratch.detection, touch, count);
  if (scratch.is_first_pass) want_ahead(body, state.surface, scratch.detection);
  look_from_origin(body, state.surface.tree, tool.tool, scratch.detection, touch);
  if (is_lost(body, state.surface.tree, touch)) {
    tool.engaged = false;
    tool.status |= StepStatus::inside_body;
    return;
  }
  for (Index k = 0; k < touch.usable; ++k) {
    const TouchingPair& pair = scratch.detection.pairs[k];
    if (!is_held(body, state, number, nodes_of(body, pair.simplex)))
      touch_simplex(body, state, scratch, touch, pair);
  }
  if (scratch.is_first_pass)
    turn_ahead(body, state.surface.near, tool, touch.core, scratch.detection, touch.first_candidate);
}

/// Adds the nodes of a held contact to the near field; false if they do not fit.
bool want_held(const ElasticBody& body, SurfaceState& surface, const ContactPoint& held) noexcept {
  bool moved = false;
  bool room = true;
  for_each_node(body, surface.near, held, [&](Index node, double) {
    room = want_nodes(body, surface, {node, -1, -1}, moved) && room;
  });
  return room && (held.aggregate < 0 || surface.near.want(body, body.aggregate_node(held.aggregate)));
}

/// Updates the held contacts' positions. Those whose nodes do not fit are released.
void update_held(const ElasticBody& body, State& state) noexcept {
  Index kept = 0;
  for (Index k = 0; k < state.held_count; ++k) {
    ContactPoint& contact = state.contact_points[k];
    ToolState& tool = state.tools[contact.tool];
    if (!want_held(body, state.surface, contact)) {
      tool.status |= StepStatus::capacity_full;
      continue;
    }
    contact.position.setZero();
    for_each_node(body, state.surface.near, contact, [&](Index node, double weight) {
      contact.position += weight * state.surface.tree.position(node);
    });
    contact.arm = tool.pose.orientation * contact.tool_point;
    state.contact_points[kept++] = contact;
  }
  state.held_count = kept;
  state.surface.tree.refit();
}

}  // namespace

void find_contacts(const ElasticBody& body, State& state, Scratch& scratch) noexcept {
  update_held(body, state);
  scratch.detection.candidate_count = 0;
  scratch.detection.between_count = 0;
  scratch.detection.left_out_count = 0;
  for (Index k = 0; k < static_cast<Index>(state.tools.size()); ++k) {
    if (state.tools[k].engaged) find_candidates(body, state, scratch, k);
  }
  merge_contacts(body, state, scratch);

  const Index room = state.max_contacts() - state.held_count;
  const auto begin = scratch.detection.candidates.begin();
  if (scratch.detection.candidate_count > room) {
    std::nth_element(begin, begin + room, begin + scratch.detection.candidate_count,
                     [](const ContactPoint& a, const ContactPoint& b) {
                       return a.free_gap < b.free_gap || (a.free_gap == b.free_gap && a.feature < b.feature);
                     });
    state.status |= StepStatus::capacity_full;
    for (Index k = room; k < scratch.detection.candidate_count; ++k)
      leave_out_contact(body, state, scratch.detection, scratch.detection.candidates[k]);
    scratch.detection.candidate_count = room;
  }
  std::copy_n(begin, scratch.detection.candidate_count, state.contact_points.begin() + state.held_count);
  state.contact_count = state.held_count + scratch.detection.candidate_count;
}

}  // namespace palpate
