// Polygons of a surface file, before anyone knows whether they make a surface.
#pragma once

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Polygons that share points by number, as a file gives them.
struct PolygonSoup {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Point = Kernel::Point_3;
  using Polygon = std::vector<std::size_t>;

  std::vector<Point> points;  ///< in the file's length unit
  std::vector<Polygon> polygons;
  std::vector<std::string> remarks;  ///< what of the file is not used, a sentence each
};

/// "(1, 2, 3)"
std::string shown(const PolygonSoup::Point& p);
inline std::string shown(const Vec3& x) {
  return shown(PolygonSoup::Point(x[0], x[1], x[2]));
}

/// Merges points at the same place, drops what collapses to less than a triangle and points that no polygon
/// has. Returns how many polygons were dropped.
std::size_t weld(PolygonSoup& soup);

/// Two points, the smaller number first.
using SoupEdge = std::array<std::size_t, 2>;

/// Edges of the polygons, one for each polygon that has it, those alike next to each other.
std::vector<SoupEdge> sorted_edges(const PolygonSoup& soup);

/// Joins points of welded polygons that only rounding has torn apart: where edges are open, points of them
/// that are within 1e-6 of the diagonal; or, where that leaves fewer edges open and no polygon without area,
/// within 1e-5 or 1e-4. Returns what was done, empty for nothing.
std::string join_seams(PolygonSoup& soup);

}  // namespace palpate
