// Polygons of a surface file, not necessarily a surface.
#pragma once

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Polygons with common points by number, as in a file.
struct PolygonSoup {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Point = Kernel::Point_3;
  using Polygon = std::vector<std::size_t>;

  std::vector<Point> points;  ///< in the file's length unit
  std::vector<Polygon> polygons;
  std::vector<std::string> remarks;  ///< unused parts of the file, a sentence each
};

/// Text for a point: "(1, 2, 3)".
std::string shown(const PolygonSoup::Point& p);
inline std::string shown(const Vec3& x) {
  return shown(PolygonSoup::Point(x[0], x[1], x[2]));
}

/// Merges points at the same place, and drops polygons that collapse to less than a triangle and unused
/// points. Returns the number of dropped polygons.
std::size_t weld(PolygonSoup& soup);

/// Two points, the smaller number first.
using SoupEdge = std::array<std::size_t, 2>;

/// Edges of the polygons, one for each polygon that has it, equal ones adjacent.
std::vector<SoupEdge> sorted_edges(const PolygonSoup& soup);

/// Joins points of welded polygons separated by rounding alone: points of open edges within 1e-6 of the
/// diagonal; or, if that leaves fewer edges open and no polygon without area, within 1e-5 or 1e-4. Returns
/// what was done, empty for nothing.
std::string join_seams(PolygonSoup& soup);

}  // namespace palpate
