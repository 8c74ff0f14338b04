#include "precompute/surfaces/polygon_soup.h"

#include <CGAL/IO/polygon_soup_io.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "base/error.h"

namespace palpate {
namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using Point = PolygonSoup::Point;
using Polygon = PolygonSoup::Polygon;

constexpr double largest_coordinate = 1e30;

/// What CGAL's readers leave to others.
void check_soup(const PolygonSoup& soup, const std::string& where) {
  for (const Point& p : soup.points) {
    for (int axis = 0; axis < 3; ++axis) {
      if (!(std::abs(p[axis]) <= largest_coordinate)) {
        throw Error("a coordinate is not a finite number or beyond all measure: " + shown(p), where,
                    "export the surface again");
      }
    }
  }
  for (std::size_t i = 0; i < soup.polygons.size(); ++i) {
    for (const std::size_t corner : soup.polygons[i]) {
      if (corner >= soup.points.size()) {
        throw Error("polygon " + std::to_string(i + 1) + " of " + std::to_string(soup.polygons.size()) +
                        " has a corner that is none of the file's " + std::to_string(soup.points.size()) +
                        " points",
                    where, "the file is damaged: export the surface again");
      }
    }
  }
}

}  // namespace

std::string shown(const Point& p) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << "(" << p.x() << ", " << p.y() << ", " << p.z() << ")";
  return text.str();
}

PolygonSoup read_polygon_soup(const std::filesystem::path& file, const std::string& where) {
  PolygonSoup soup;
  bool read = false;
  try {
    read = CGAL::IO::read_polygon_soup(file.string(), soup.points, soup.polygons,
                                       CGAL::parameters::verbose(false));
  } catch (const std::exception&) {
    read = false;
  }
  if (!read || soup.polygons.empty()) {
    throw Error("cannot read a surface from this file", where,
                "it must be a complete .off, .obj, .stl or .ply with triangles or polygons");
  }
  check_soup(soup, where);
  return soup;
}

std::size_t weld(PolygonSoup& soup) {
  PMP::merge_duplicate_points_in_polygon_soup(soup.points, soup.polygons);
  for (Polygon& polygon : soup.polygons) {
    polygon.erase(std::unique(polygon.begin(), polygon.end()), polygon.end());
    while (polygon.size() > 1 && polygon.front() == polygon.back()) {
      polygon.pop_back();
    }
  }
  const std::size_t dropped =
      std::erase_if(soup.polygons, [](const Polygon& polygon) { return polygon.size() < 3; });
  PMP::remove_isolated_points_in_polygon_soup(soup.points, soup.polygons);
  return dropped;
}

}  // namespace palpate
