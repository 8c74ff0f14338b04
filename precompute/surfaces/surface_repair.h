// Broken surfaces made whole.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "precompute/surfaces/surface_input.h"

namespace palpate {

/// Which of a surface's disconnected parts become the body.
enum class SurfaceParts : std::uint8_t {
  most,     ///< as largest, where that is nine tenths of the area and of what all enclose; else none
  largest,  ///< that with the largest area, and its cavities; the others are dropped
  all,      ///< all of them, united into one: parts must overlap or nearly touch
};

/// A surface as read_surface would give it, and what was done to make it so.
struct RepairedSurface {
  TriangleSurface surface;
  std::vector<std::string> repairs;  ///< a sentence each, without a full stop; empty: the file was whole
  std::vector<std::string> remarks;  ///< what of the file is not used, likewise
};

/// Reads a surface and repairs what is wrong with it, by CGAL's Polygon Mesh Processing, in child processes:
/// doubled and degenerate polygons, more than two triangles in an edge, flipped triangles, open seams, other
/// parts, holes, self-intersections. Closed shells in the body are its cavities. What is still not closed,
/// manifold and free of self-intersections then is wrapped (wrapped_surface), for a mesh of `wrap_nodes`
/// surface nodes. Throws Error when the file cannot be read, when nothing is enclosed, when parts to unite
/// are apart, and when too much would be dropped.
RepairedSurface repair_surface(const std::filesystem::path& file, SurfaceParts parts, int wrap_nodes);

/// Part of the edge that a wrapping keeps from the surface, unless it has a reason for another.
inline constexpr double usual_wrap_offset = 0.05;

/// A closed surface without self-intersections around a broken one, at a distance of `offset` times `edge`
/// [unit of the surface]; gaps narrower than half of `edge` are bridged (CGAL's Alpha_wrap_3), in a child
/// process. Throws Error (where = `where`) when the parts are apart, and where CGAL fails.
TriangleSurface wrapped_surface(const TriangleSurface& surface, double edge, double offset,
                                const std::string& where);

/// Mean edge of a surface mesh of equilateral triangles that has so many nodes on this area: each node has
/// two triangles of area sqrt(3)/4 edge^2. [unit of sqrt(area)]
double edge_for_nodes(double area, double nodes);

/// A surface as the text of an OFF file; reads back as the same numbers.
std::string off_text(const TriangleSurface& surface);

}  // namespace palpate
