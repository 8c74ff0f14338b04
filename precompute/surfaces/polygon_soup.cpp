#include "precompute/surfaces/polygon_soup.h"

#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/bounding_box.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <locale>
#include <numeric>
#include <sstream>
#include <utility>

namespace palpate {
namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using Point = PolygonSoup::Point;
using Kernel = PolygonSoup::Kernel;
using Polygon = PolygonSoup::Polygon;

/// Drops repeated consecutive corners, and then polygons of less than three. Returns the number of polygons
/// dropped.
std::size_t collapse(PolygonSoup& soup) {
  for (Polygon& polygon : soup.polygons) {
    polygon.erase(std::unique(polygon.begin(), polygon.end()), polygon.end());
    while (polygon.size() > 1 && polygon.front() == polygon.back()) polygon.pop_back();
  }
  return std::erase_if(soup.polygons, [](const Polygon& polygon) { return polygon.size() < 3; });
}

/// Ends of all edges that only one polygon has, twice as many as there are such edges.
std::vector<std::size_t> open_points(const PolygonSoup& soup) {
  const std::vector<SoupEdge> edges = sorted_edges(soup);
  std::vector<std::size_t> points;
  for (auto edge = edges.begin(); edge != edges.end();) {
    const auto end = std::find_if(edge, edges.end(), [&](const SoupEdge& other) { return other != *edge; });
    if (end - edge == 1) points.insert(points.end(), edge->begin(), edge->end());
    edge = end;
  }
  return points;
}

/// Joins those of `points` that are within `distance`, directly or through others. Returns false if there are
/// none.
bool join(PolygonSoup& soup, std::vector<std::size_t> points, double distance) {
  const Kernel::Vector_3 across(0.61, 0.53, 0.59);  // along no grid or face that a program makes
  const auto place = [&](std::size_t i) { return (soup.points[i] - CGAL::ORIGIN) * across; };
  std::ranges::sort(
      points, [&](std::size_t a, std::size_t b) { return std::pair(place(a), a) < std::pair(place(b), b); });
  points.erase(std::unique(points.begin(), points.end()), points.end());
  std::vector<std::size_t> to(soup.points.size());
  std::iota(to.begin(), to.end(), std::size_t{0});
  const auto root = [&](std::size_t i) {
    while (to[i] != i) i = to[i] = to[to[i]];
    return i;
  };
  for (auto a = points.begin(); a != points.end(); ++a) {
    for (auto b = a + 1; b != points.end() && place(*b) - place(*a) <= distance; ++b) {
      if (CGAL::squared_distance(soup.points[*a], soup.points[*b]) <= distance * distance)
        to[root(*b)] = root(*a);
    }
  }
  for (Polygon& polygon : soup.polygons) std::ranges::transform(polygon, polygon.begin(), root);
  return std::ranges::any_of(points, [&](std::size_t i) { return root(i) != i; });
}

}  // namespace

std::string shown(const Point& p) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << "(" << p.x() << ", " << p.y() << ", " << p.z() << ")";
  return text.str();
}

std::size_t weld(PolygonSoup& soup) {
  PMP::merge_duplicate_points_in_polygon_soup(soup.points, soup.polygons);
  const std::size_t dropped = collapse(soup);
  PMP::remove_isolated_points_in_polygon_soup(soup.points, soup.polygons);
  return dropped;
}

std::vector<SoupEdge> sorted_edges(const PolygonSoup& soup) {
  std::vector<SoupEdge> edges;
  for (const Polygon& polygon : soup.polygons) {
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const auto [a, b] = std::minmax(polygon[i], polygon[(i + 1) % polygon.size()]);
      edges.push_back({a, b});
    }
  }
  std::ranges::sort(edges);
  return edges;
}

std::string join_seams(PolygonSoup& soup) {
  const std::vector<std::size_t> loose = open_points(soup);
  if (loose.empty()) return {};
  const CGAL::Bbox_3 box = CGAL::bbox_3(soup.points.begin(), soup.points.end());
  const double diagonal =
      std::hypot(box.xmax() - box.xmin(), box.ymax() - box.ymin(), box.zmax() - box.zmin());
  std::size_t open = loose.size();
  double within = 0.0;
  for (const double share : {1e-6, 1e-5, 1e-4}) {
    PolygonSoup joined = soup;
    if (open == 0 || !join(joined, loose, share * diagonal)) continue;
    const std::size_t dropped = collapse(joined), left = open_points(joined).size();
    if (share > 1e-6 && (dropped != 0 || left >= open)) continue;
    soup = std::move(joined);
    open = left;
    within = share * diagonal;
  }
  const std::size_t points = PMP::remove_isolated_points_in_polygon_soup(soup.points, soup.polygons);
  return points == 0
             ? ""
             : fmt::format(
                   "{} points were joined to others within {:.1g} units, as a seam was open by rounding",
                   points, within);
}

}  // namespace palpate
