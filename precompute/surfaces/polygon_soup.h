// Polygons of a surface file, before anyone knows whether they make a surface.
#pragma once

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

/// Polygons that share points by number, as a file gives them.
struct PolygonSoup {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Point = Kernel::Point_3;
  using Polygon = std::vector<std::size_t>;

  std::vector<Point> points;  ///< in the file's length unit
  std::vector<Polygon> polygons;
};

/// "(1, 2, 3)"
std::string shown(const PolygonSoup::Point& p);

/// Reads the bytes of an OFF, OBJ, STL or PLY file, by its extension. Throws Error (where = `file`) when it
/// cannot, when a coordinate is no finite number, and when a corner is none of the points. Foreign code: for
/// child processes.
PolygonSoup read_polygon_soup(const std::string& bytes, const std::filesystem::path& file);

/// Merges points at the same place, drops what collapses to less than a triangle and points that no polygon
/// has. Returns how many polygons were dropped.
std::size_t weld(PolygonSoup& soup);

}  // namespace palpate
