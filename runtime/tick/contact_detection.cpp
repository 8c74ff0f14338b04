#include "runtime/tick/contact_detection.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/tick/state.h"

namespace palpate {
namespace {

constexpr double same_place = 1e-4;       // of the mean edge: nearer contact points are one
constexpr double same_held_place = 0.05;  // of the mean edge: nearer to a held place nothing else is touched
constexpr double same_direction = 1e-6;   // 1 - cos of their normals
constexpr double deepest_inside = 0.25;   // of the mean edge: deeper, the tool is lost in the body
constexpr double smooth_radius = 6.0;  // of a simplex's mean edge: a larger sphere touches its corners alone
constexpr double on_surface =
    1e-6;  // of the mean edge: nearer, the face tells the normal and not the distance

std::array<Index, 3> nodes_of(const Body& body, Index simplex) noexcept {
  const auto d = static_cast<std::size_t>(body.dimension());
  const std::size_t at = d * static_cast<std::size_t>(simplex);
  const std::span<const Index> simplices = body.simplices();
  return {simplices[at], simplices[at + 1], d == 3 ? simplices[at + 2] : -1};
}

Vec3 outward_normal(const SurfaceTree& tree, const std::array<Index, 3>& nodes) noexcept {
  const Vec3& a = tree.position(nodes[0]);
  const Vec3& b = tree.position(nodes[1]);
  Vec3 normal;
  if (nodes[2] < 0) {
    normal = Vec3(b.y() - a.y(), a.x() - b.x(), 0.0);
  } else {
    normal = (b - a).cross(tree.position(nodes[2]) - a);
  }
  const double length = normal.norm();
  return length > 0.0 ? Vec3(normal / length) : Vec3::Zero();
}

/// Mean length of a simplex's edges at rest [m].
double mean_edge(const Body& body, const std::array<Index, 3>& nodes) noexcept {
  const auto at = [&](std::size_t k) {
    return body.surface_rest_positions()[static_cast<std::size_t>(nodes[k])];
  };
  const double first = (at(1) - at(0)).norm();
  return nodes[2] < 0 ? first : (first + (at(2) - at(1)).norm() + (at(0) - at(2)).norm()) / 3.0;
}

NearestPoint nearest_on_simplex(const SurfaceTree& tree, const std::array<Index, 3>& nodes,
                                const Vec3& point) noexcept {
  const Vec3& a = tree.position(nodes[0]);
  const Vec3& b = tree.position(nodes[1]);
  return nodes[2] < 0 ? nearest_on_line(point, a, b)
                      : nearest_on_triangle(point, a, b, tree.position(nodes[2]));
}

NearestPoint nearest_to_core(const SurfaceTree& tree, const std::array<Index, 3>& nodes,
                             const Core& core) noexcept {
  const Vec3& a = tree.position(nodes[0]);
  const Vec3& b = tree.position(nodes[1]);
  return nodes[2] < 0 ? nearest_of_segments(core.origin, core.end, a, b)
                      : nearest_of_segment_and_triangle(core.origin, core.end, a, b, tree.position(nodes[2]));
}

/// Nearest points of a tool's core and a corner of a simplex.
NearestPoint nearest_to_corner(const SurfaceTree& tree, const std::array<Index, 3>& nodes, std::size_t corner,
                               const Core& core) noexcept {
  NearestPoint result;
  result.weights[corner] = 1.0;
  result.on_simplex = tree.position(nodes[corner]);
  result.on_core = nearest_on_line(result.on_simplex, core.origin, core.end).on_simplex;
  result.squared_distance = (result.on_core - result.on_simplex).squaredNorm();
  return result;
}

/// Nearest points of a tool's core and the edge of a triangle between two of its corners.
NearestPoint nearest_to_edge(const SurfaceTree& tree, const std::array<Index, 3>& nodes, std::size_t from,
                             std::size_t to, const Core& core) noexcept {
  NearestPoint result =
      nearest_of_segments(core.origin, core.end, tree.position(nodes[from]), tree.position(nodes[to]));
  const std::array<double, 3> weights = result.weights;
  result.weights = {};
  result.weights[from] = weights[0];
  result.weights[to] = weights[1];
  return result;
}

NearestPoint nearest(const SurfaceTree& tree, const std::array<Index, 3>& nodes, const Core& core,
                     bool is_point) noexcept {
  return is_point ? nearest_on_simplex(tree, nodes, core.origin) : nearest_to_core(tree, nodes, core);
}

/// Same vertex, edge or face, same place on the same tool: the same number. Faces have the simplex's number;
/// edges and vertices those of their nodes.
std::int64_t feature_of(Index tool, int place, Index simplex, bool face_tells,
                        const std::array<Index, 3>& nodes, const std::array<double, 3>& weights) noexcept {
  std::array<Index, 3> used{};
  int count = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    if (weights[k] > 0.0) used[static_cast<std::size_t>(count++)] = nodes[k];
  }
  const std::int64_t head = (std::int64_t{tool} * 4 + place) * 4;
  constexpr std::int64_t room = std::int64_t{1} << 26;
  if (face_tells || count == 3) return (head + 3) * room * room + simplex;
  if (count == 1) return (head + 1) * room * room + used[0];
  return (head + 2) * room * room + std::min(used[0], used[1]) * room + std::max(used[0], used[1]);
}

Vec3 displacement_of(const Body& body, const State& state, const ContactPoint& contact) noexcept {
  Vec3 u = Vec3::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    if (contact.nodes[k] < 0 || !body.surface_moves(contact.nodes[k])) continue;
    u += contact.weights[k] * state.near.displacement(state.near.place_of(contact.nodes[k]));
  }
  return u;
}

/// Two tangents beside the normal: in the plane one within it.
Eigen::Matrix3d frame_of(const Vec3& normal, int dimension) noexcept {
  Eigen::Matrix3d frame;
  frame.col(0) = normal;
  if (dimension == 2) {
    frame.col(1) = Vec3(-normal.y(), normal.x(), 0.0);
  } else {
    frame.col(1) = normal.unitOrthogonal();
  }
  frame.col(2) = frame.col(0).cross(frame.col(1));
  return frame;
}

/// Gradients of the barycentric weights that are not zero, along the edge or face that they span.
std::array<Vec3, 3> slopes(const SurfaceTree& tree, const std::array<Index, 3>& nodes) noexcept {
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

/// Puts the nodes of a simplex into the near field, at their present places in the tree.
bool want_nodes(const Body& body, State& state, const std::array<Index, 3>& nodes) noexcept {
  bool room = true;
  for (const Index node : nodes) {
    if (node < 0 || !body.surface_moves(node)) continue;
    room = state.near.want(body, node) && room;
  }
  if (!room) return false;
  for (const Index node : nodes) {
    if (node < 0 || !body.surface_moves(node)) continue;
    state.tree.move(
        node, unloaded_position(body, state, node) + state.near.displacement(state.near.place_of(node)));
  }
  return true;
}

/// The simplices nearest to the tool by what the tree knows, at most as many as may be looked at: fills
/// state.found and returns how many.
std::size_t nearest_simplices(const Body& body, State& state, ToolState& tool, const Core& core,
                              double reach) noexcept {
  const std::size_t all = state.tree.near_segment(core.origin, core.end, reach, state.found);
  const bool is_point = tool.tool.length == 0.0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < std::min(all, state.found.size()); ++k) {
    const Index simplex = state.found[k];
    const double distance = nearest(state.tree, nodes_of(body, simplex), core, is_point).squared_distance;
    if (distance > reach * reach) continue;
    state.found[count] = simplex;
    state.found_distance[static_cast<std::size_t>(simplex)] = distance;
    ++count;
  }
  if (all > state.found.size()) tool.status |= StepStatus::capacity_full;
  if (count > state.most_simplices) {
    tool.status |= StepStatus::capacity_full;
    const auto nearer = [&](Index a, Index b) {
      const double da = state.found_distance[static_cast<std::size_t>(a)];
      const double db = state.found_distance[static_cast<std::size_t>(b)];
      return da < db || (da == db && a < b);
    };
    std::nth_element(state.found.begin(),
                     state.found.begin() + static_cast<std::ptrdiff_t>(state.most_simplices),
                     state.found.begin() + static_cast<std::ptrdiff_t>(count), nearer);
    count = state.most_simplices;
  }
  return count;
}

bool is_duplicate(const Body& body, const State& state, Index begin, const Vec3& position,
                  const Vec3& normal) noexcept {
  const double near = same_place * body.mean_surface_edge();
  for (Index k = begin; k < state.candidate_count; ++k) {
    const ContactPoint& other = state.candidates[static_cast<std::size_t>(k)];
    if ((other.position - position).squaredNorm() < near * near &&
        other.frame.col(0).dot(normal) > 1.0 - same_direction) {
      return true;
    }
  }
  return false;
}

/// Whether a held contact of the same tool is at the same place, or holds all that this one touches.
bool is_held_already(const Body& body, const State& state, const ContactPoint& contact) noexcept {
  const double near = same_held_place * body.mean_surface_edge();
  const auto holds = [](const ContactPoint& held, Index node) {
    return node < 0 || std::find(held.nodes.begin(), held.nodes.end(), node) != held.nodes.end();
  };
  return std::any_of(state.contact_points.begin(), state.contact_points.begin() + state.held_count,
                     [&](const ContactPoint& held) {
                       return held.tool == contact.tool &&
                              ((held.position - contact.position).squaredNorm() < near * near ||
                               std::all_of(contact.nodes.begin(), contact.nodes.end(),
                                           [&](Index node) { return holds(held, node); }));
                     });
}

void add_candidate(const Body& body, State& state, Index tool_number, Index begin, const TouchingPair& pair,
                   bool face_tells) noexcept {
  ToolState& tool = state.tools[static_cast<std::size_t>(tool_number)];
  if (static_cast<std::size_t>(state.candidate_count) == state.candidates.size()) {
    tool.status |= StepStatus::capacity_full;
    return;
  }
  const Vec3 normal =
      face_tells ? pair.normal : Vec3((pair.nearest.on_core - pair.nearest.on_simplex) / pair.distance);
  if (is_duplicate(body, state, begin, pair.nearest.on_simplex, normal)) return;
  const std::array<Index, 3> nodes = nodes_of(body, pair.simplex);
  ContactPoint contact;
  contact.feature =
      feature_of(tool_number, pair.place, pair.simplex, face_tells, nodes, pair.nearest.weights);
  contact.tool = tool_number;
  contact.simplex = pair.simplex;
  contact.weights = pair.nearest.weights;
  for (std::size_t k = 0; k < 3; ++k) contact.nodes[k] = contact.weights[k] > 0.0 ? nodes[k] : -1;
  contact.position = pair.nearest.on_simplex;
  if (is_held_already(body, state, contact)) return;
  contact.arm = contact.position - tool.pose.position;
  contact.slope = slopes(state.tree, contact.nodes);
  contact.frame = frame_of(normal, body.dimension());
  contact.gap = (face_tells ? pair.height : pair.distance) - tool.tool.radius;
  contact.friction =
      tool.tool.friction.value_or(body.surface_friction()[static_cast<std::size_t>(pair.simplex)]);
  contact.free_gap = contact.gap + normal.dot(device_motion(tool.pose, tool.device, contact.arm) +
                                              displacement_of(body, state, contact));
  state.candidates[static_cast<std::size_t>(state.candidate_count++)] = contact;
}

/// Whether the simplex carried force at the same tool in the tick or pass before.
bool carried(const State& state, Index tool, const TouchingPair& pair) noexcept {
  const auto begin = state.last_contacts.begin();
  return std::any_of(begin, begin + state.last_count, [&](const ContactPoint& last) {
    return last.tool == tool && last.simplex == pair.simplex && !last.held && last.force.squaredNorm() > 0.0;
  });
}

/// Contact points of one tool. From outside, a simplex is touched from its outer side: those that turn their
/// back are behind others. From a little inside (rounding, or a fast tick), the nearest ones and those that
/// carried force push out along their normals.
void find_candidates(const Body& body, State& state, Index tool_number, double margin) noexcept {
  ToolState& tool = state.tools[static_cast<std::size_t>(tool_number)];
  const double edge = body.mean_surface_edge();
  const Core core = core_of(tool.tool, tool.pose, body.dimension());
  const double lost = deepest_inside * edge;
  const std::size_t count =
      nearest_simplices(body, state, tool, core, std::max(tool.tool.radius + margin, lost));

  Index usable = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const Index simplex = state.found[k];
    if (!want_nodes(body, state, nodes_of(body, simplex))) {
      tool.status |= StepStatus::capacity_full;
      continue;
    }
    state.found[static_cast<std::size_t>(usable++)] = simplex;
  }

  const auto make_pair = [&](Index simplex, int place, const NearestPoint& nearest) {
    TouchingPair pair{.simplex = simplex, .place = place, .nearest = nearest};
    pair.normal = outward_normal(state.tree, nodes_of(body, simplex));
    const Vec3 across = nearest.on_core - nearest.on_simplex;
    pair.height = across.dot(pair.normal);
    pair.distance = across.norm();
    return pair;
  };
  const auto pair_of_end = [&](Index simplex, int place) {
    const Vec3& end = place == 0 ? core.origin : core.end;
    NearestPoint nearest = nearest_on_simplex(state.tree, nodes_of(body, simplex), end);
    nearest.on_core = end;
    return make_pair(simplex, place, nearest);
  };

  double nearest_distance = std::numeric_limits<double>::infinity();
  for (Index k = 0; k < usable; ++k) {
    TouchingPair& pair = state.pairs[static_cast<std::size_t>(k)];
    pair = pair_of_end(state.found[static_cast<std::size_t>(k)], 0);
    nearest_distance = std::min(nearest_distance, pair.distance);
  }
  const auto is_nearest = [&](const TouchingPair& pair) {
    return pair.place == 0 && pair.distance <= nearest_distance + on_surface * edge;
  };
  double side = 0.0;
  for (Index k = 0; k < usable; ++k) {
    const TouchingPair& pair = state.pairs[static_cast<std::size_t>(k)];
    if (is_nearest(pair)) side += pair.height;
  }
  const bool inside = side < 0.0;
  if (inside && nearest_distance > lost) {
    tool.engaged = false;
    return;
  }

  const Index begin = state.candidate_count;
  const auto touch = [&](const TouchingPair& pair) {
    const bool pushes_out =
        pair.height < 0.0 && ((inside && pair.distance <= 2.0 * nearest_distance) ||
                              (carried(state, tool_number, pair) && pair.distance < lost));
    const bool face_tells = pushes_out || pair.distance < on_surface * edge;
    if (!face_tells && (pair.height < 0.0 || pair.distance - tool.tool.radius > margin)) return;
    add_candidate(body, state, tool_number, begin, pair, face_tells);
  };
  // On what is flat as seen from it, a segment or large sphere has its one nearest point now at the one side,
  // now at the other: all corners under it are contact points, and under a segment the edges.
  const bool is_segment = tool.tool.length > 0.0;
  // Between its nodes the surface is smooth: its triangles are chords of a sphere that is large against them,
  // and would hold it out by edge^2 / 6 R.
  const auto is_chord = [&](Index simplex) {
    return !is_segment && tool.tool.radius > smooth_radius * mean_edge(body, nodes_of(body, simplex));
  };
  const auto touch_corners = [&](Index simplex) {
    const std::array<Index, 3> nodes = nodes_of(body, simplex);
    const std::size_t corners = nodes[2] < 0 ? 2 : 3;
    for (std::size_t n = 0; n < corners; ++n) {
      touch(make_pair(simplex, is_segment ? 2 : 0, nearest_to_corner(state.tree, nodes, n, core)));
      if (is_segment && corners == 3)
        touch(make_pair(simplex, 2, nearest_to_edge(state.tree, nodes, n, (n + 1) % 3, core)));
    }
  };
  for (Index k = 0; k < usable; ++k) {
    const Index simplex = state.found[static_cast<std::size_t>(k)];
    TouchingPair pair = state.pairs[static_cast<std::size_t>(k)];
    const bool chord = is_chord(simplex);
    if (!chord) touch(pair);
    if (is_segment) {
      touch(pair_of_end(simplex, 1));
      pair = make_pair(simplex, 2, nearest_to_core(state.tree, nodes_of(body, simplex), core));
      touch(pair);
    }
    if ((is_segment || chord || tool.tool.radius > edge) && pair.distance - tool.tool.radius <= margin)
      touch_corners(simplex);
  }
}

/// Where held contacts are now. Those whose nodes find no room are let go.
void update_held(const Body& body, State& state) noexcept {
  Index kept = 0;
  for (Index k = 0; k < state.held_count; ++k) {
    ContactPoint& contact = state.contact_points[static_cast<std::size_t>(k)];
    ToolState& tool = state.tools[static_cast<std::size_t>(contact.tool)];
    if (!want_nodes(body, state, contact.nodes)) {
      tool.status |= StepStatus::capacity_full;
      continue;
    }
    contact.position.setZero();
    for (std::size_t n = 0; n < 3; ++n) {
      if (contact.nodes[n] >= 0)
        contact.position += contact.weights[n] * state.tree.position(contact.nodes[n]);
    }
    contact.arm = tool.pose.orientation * contact.tool_point;
    state.contact_points[static_cast<std::size_t>(kept++)] = contact;
  }
  state.held_count = kept;
}

/// Whether no simplex is within a distance of a tool's core, nor cut by it.
bool keeps_distance(const Body& body, State& state, const Tool& tool, const Core& core,
                    double distance) noexcept {
  const std::size_t count = state.tree.near_segment(core.origin, core.end, distance, state.found);
  return std::all_of(
      state.found.begin(), state.found.begin() + static_cast<std::ptrdiff_t>(count), [&](Index simplex) {
        const NearestPoint pair = nearest(state.tree, nodes_of(body, simplex), core, tool.length == 0.0);
        return pair.squared_distance > 0.0 && pair.squared_distance >= distance * distance;
      });
}

}  // namespace

Core core_of(const Tool& tool, const ToolPose& pose, int dimension) noexcept {
  if (tool.length == 0.0) return {pose.position, pose.position};
  const Vec3 axis = pose.orientation * (dimension == 3 ? Vec3::UnitZ() : Vec3::UnitY());
  return {pose.position, pose.position + tool.length * axis};
}

Vec3 device_motion(const ToolPose& from, const ToolPose& to, const Vec3& arm) noexcept {
  return to.position - from.position + to.orientation * (from.orientation.conjugate() * arm) - arm;
}

void find_contacts(const Body& body, State& state) noexcept {
  update_held(body, state);
  state.candidate_count = 0;
  for (Index k = 0; k < static_cast<Index>(state.tools.size()); ++k) {
    ToolState& tool = state.tools[static_cast<std::size_t>(k)];
    if (tool.engaged) find_candidates(body, state, k, tool.margin);
  }

  Index room = state.max_contacts - state.held_count;
  const auto begin = state.candidates.begin();
  if (state.candidate_count > room) {
    std::nth_element(begin, begin + room, begin + state.candidate_count,
                     [](const ContactPoint& a, const ContactPoint& b) {
                       return a.free_gap < b.free_gap || (a.free_gap == b.free_gap && a.feature < b.feature);
                     });
    state.status |= StepStatus::capacity_full;
    state.candidate_count = room;
  }
  std::copy_n(begin, state.candidate_count, state.contact_points.begin() + state.held_count);
  state.contact_count = state.held_count + state.candidate_count;
}

bool is_outside(const Body& body, State& state, const Tool& tool, const ToolPose& pose) noexcept {
  const Core core = core_of(tool, pose, body.dimension());
  return !state.tree.inside(core.origin) &&
         (tool.length == 0.0 ||
          (!state.tree.inside(core.end) && keeps_distance(body, state, tool, core, 0.0)));
}

bool is_clear(const Body& body, State& state, const Tool& tool, const ToolPose& pose) noexcept {
  const Core core = core_of(tool, pose, body.dimension());
  const double radius = tool.radius - on_surface * body.mean_surface_edge();
  return is_outside(body, state, tool, pose) &&
         (radius <= 0.0 || keeps_distance(body, state, tool, core, radius));
}

}  // namespace palpate
