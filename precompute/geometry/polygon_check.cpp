#include "precompute/geometry/polygon_check.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_2_algorithms.h>
#include <CGAL/box_intersection_d.h>
#include <CGAL/intersections.h>
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "base/error.h"

namespace palpate {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_2;
using Line = std::vector<Point>;  // closed: the last point is joined to the first

/// An edge of one of the lines.
struct Edge {
  std::size_t line;
  std::size_t number;
  Kernel::Segment_2 segment;
};

std::string shown(const Point& p) {
  return fmt::format("({:.6g}, {:.6g})", p.x(), p.y());
}

std::string shown(const Kernel::Segment_2& s) {
  return "from " + shown(s.source()) + " to " + shown(s.target());
}

/// Name of a line; line 0 is the outer one.
std::string name_of(std::size_t line) {
  return line == 0 ? "the outer line" : "hole " + std::to_string(line);
}

std::vector<Line> lines_of(const PolygonGeometry& polygon) {
  const auto as_line = [](const std::vector<Vec3>& points) {
    Line line;
    for (const Vec3& x : points) {
      line.emplace_back(x[0], x[1]);
    }
    return line;
  };
  std::vector<Line> lines = {as_line(polygon.points)};
  std::transform(polygon.holes.begin(), polygon.holes.end(), std::back_inserter(lines), as_line);
  return lines;
}

void check_points(const Line& points, const std::string& name, const std::string& where) {
  std::map<Point, std::size_t> number;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto [first, is_new] = number.try_emplace(points[i], i);
    if (!is_new) {
      throw Error(fmt::format("points {} and {} of {} are the same: {}", first->second + 1, i + 1, name,
                              shown(points[i])),
                  where, "give each point once; the last one is joined to the first by itself");
    }
  }
  if (points.size() < 3) {
    throw Error(fmt::format("{} has {} point(s)", name, points.size()), where, "give at least three points");
  }
  if (std::all_of(points.begin() + 2, points.end(),
                  [&](const Point& p) { return CGAL::collinear(points[0], points[1], p); })) {
    throw Error(fmt::format("{} has no area: its points are all on one straight line through {} and {}", name,
                            shown(points[0]), shown(points[1])),
                where, "give points around an area");
  }
}

/// True if two edges have more in common than the end where one follows the other.
bool collide(const Edge& a, const Edge& b, std::size_t points_of_line) {
  if (!CGAL::do_intersect(a.segment, b.segment)) {
    return false;
  }
  const auto follows = [&](const Edge& first, const Edge& second) {
    return first.line == second.line && second.number == (first.number + 1) % points_of_line;
  };
  if (follows(a, b)) {
    return a.segment.has_on(b.segment.target()) || b.segment.has_on(a.segment.source());
  }
  if (follows(b, a)) {
    return b.segment.has_on(a.segment.target()) || a.segment.has_on(b.segment.source());
  }
  return true;
}

/// First pair of edges, in the order of the input, that collide.
std::optional<std::pair<const Edge*, const Edge*>> find_collision(const std::vector<Edge>& edges,
                                                                  const std::vector<Line>& lines) {
  using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 2, const Edge*>;
  std::vector<Box> boxes;
  boxes.reserve(edges.size());
  for (const Edge& edge : edges) {
    boxes.emplace_back(edge.segment.bbox(), &edge);
  }
  std::optional<std::pair<const Edge*, const Edge*>> first;
  CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const Box& a, const Box& b) {
    if (collide(*a.info(), *b.info(), lines[a.info()->line].size())) {
      const std::pair<const Edge*, const Edge*> pair = std::minmax(a.info(), b.info());
      first = first ? std::min(*first, pair) : pair;
    }
  });
  return first;
}

/// A point common to two edges.
Point common_point(const Kernel::Segment_2& a, const Kernel::Segment_2& b) {
  Point point;
  if (CGAL::assign(point, CGAL::Object(CGAL::intersection(a, b)))) return point;
  return a.has_on(b.source()) ? b.source() : b.target();
}

void check_crossings(const std::vector<Line>& lines, const std::string& where) {
  std::vector<Edge> edges;
  for (std::size_t l = 0; l < lines.size(); ++l) {
    for (std::size_t i = 0; i < lines[l].size(); ++i) {
      edges.push_back({l, i, {lines[l][i], lines[l][(i + 1) % lines[l].size()]}});
    }
  }
  if (const auto pair = find_collision(edges, lines)) {
    const auto& [a, b] = *pair;
    throw Error(
        fmt::format(
            "{} {} at {}: the edge {} and the edge {}", name_of(a->line),
            a->line == b->line ? "crosses or touches itself" : "and " + name_of(b->line) + " cross or touch",
            shown(common_point(a->segment, b->segment)), shown(a->segment), shown(b->segment)),
        where, "list the points in their order along the line, and leave room between lines");
  }
}

bool is_within(const Point& p, const Line& line) {
  return CGAL::bounded_side_2(line.begin(), line.end(), p) == CGAL::ON_BOUNDED_SIDE;
}

/// Checks that holes lie side by side. Requires lines that do not cross, so that one point decides.
void check_holes(const std::vector<Line>& lines, const std::string& where) {
  for (std::size_t hole = 1; hole < lines.size(); ++hole) {
    if (!is_within(lines[hole][0], lines[0])) {
      throw Error(name_of(hole) + " lies outside the outer line: its point " + shown(lines[hole][0]), where,
                  "move it inside, or leave it out");
    }
    for (std::size_t other = 1; other < lines.size(); ++other) {
      if (other != hole && is_within(lines[hole][0], lines[other])) {
        throw Error(name_of(hole) + " lies within " + name_of(other) + ": its point " + shown(lines[hole][0]),
                    where, "leave it out");
      }
    }
  }
}

}  // namespace

void check_polygon(const PolygonGeometry& polygon, const std::string& where) {
  const std::vector<Line> lines = lines_of(polygon);
  for (std::size_t l = 0; l < lines.size(); ++l) {
    check_points(lines[l], name_of(l), where);
  }
  check_crossings(lines, where);
  check_holes(lines, where);
}

}  // namespace palpate
