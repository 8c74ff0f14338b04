#include "runtime/core/tick/contact_detection.h"

#include <algorithm>
#include <cmath>

#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/tick/contact_merging.h"
#include "runtime/core/tick/force_error.h"
#include "runtime/core/tick/tool_contact.h"
#include "runtime/core/touch/contact_feature.h"
#include "runtime/core/touch/contact_nodes.h"
#include "runtime/core/touch/rolling.h"

namespace palpate {
namespace {

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

/// True if the core's origin is on the outer side of a simplex at which the tool pressed in the last tick or
/// pass.
bool is_kept_out(const ElasticBody& body, const SurfaceTree& tree, const LastContacts& remembered,
                 const ToolContact& touch) noexcept {
  const auto begin = remembered.contacts.begin();
  return std::any_of(begin, begin + remembered.count, [&](const ContactPoint& last) {
    if (last.tool != touch.number || last.held || last.simplex < 0 || last.force.isZero(0.0)) return false;
    const SimplexNodes nodes = nodes_of(body, last.simplex);
    return outward_normal(tree, nodes).dot(touch.core.origin - tree.position(nodes[0])) >= 0.0;
  });
}

/// Computes the pairs of the core's origin, and the side of the nearest simplices on which it lies. Where
/// these face away deep below the tool, which still presses elsewhere, they are folds beside it.
void look_from_origin(const ElasticBody& body, const SurfaceTree& tree, const Tool& tool,
                      const LastContacts& remembered, DetectionScratch& detection,
                      ToolContact& touch) noexcept {
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
  touch.inside =
      side < 0.0 && (touch.nearest_distance <= touch.lost || !is_kept_out(body, tree, remembered, touch));
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
void find_candidates(const ElasticBody& body, State& state, Scratch& scratch, Index number,
                     Pass pass) noexcept {
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
  if (pass == Pass::first) want_ahead(body, state.surface, scratch.detection);
  look_from_origin(body, state.surface.tree, tool.tool, scratch.last, scratch.detection, touch);
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
  if (pass == Pass::first)
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

void find_contacts(const ElasticBody& body, State& state, Scratch& scratch, Pass pass) noexcept {
  update_held(body, state);
  scratch.detection.candidate_count = 0;
  scratch.detection.between_count = 0;
  scratch.detection.left_out_count = 0;
  for (Index k = 0; k < static_cast<Index>(state.tools.size()); ++k) {
    if (state.tools[k].engaged) find_candidates(body, state, scratch, k, pass);
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
