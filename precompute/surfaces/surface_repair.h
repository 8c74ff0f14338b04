// Repair of broken surfaces.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "precompute/surfaces/surface_input.h"

namespace palpate {

/// Choice of the disconnected parts of a surface that become the body.
enum class SurfaceParts : std::uint8_t {
  most,     ///< as `largest` if that has nine tenths of the area and of the enclosed volume; else an error
  largest,  ///< the one with the largest area, and its cavities; others are dropped
  all,      ///< all of them, united into one: parts must overlap or nearly touch
};

/// A surface as from read_surface, and the repairs it took.
struct RepairedSurface {
  TriangleSurface surface;
  std::vector<std::string> repairs;  ///< a sentence each, without a full stop; empty: the file needed none
  std::vector<std::string> remarks;  ///< unused parts of the file, likewise
};

/// Reads a surface and repairs it, by CGAL's Polygon Mesh Processing, in child processes: duplicate and
/// degenerate polygons, more than two triangles at an edge, flipped triangles, open seams, other parts,
/// holes, self-intersections. Closed shells in the body are its cavities. A surface that is still not closed,
/// manifold and free of self-intersections is wrapped (wrapped_surface), for a mesh of `wrap_nodes` surface
/// nodes. Throws Error if the file cannot be read, nothing is enclosed, parts to unite are apart, or too much
/// would be dropped.
RepairedSurface repair_surface(const std::filesystem::path& file, SurfaceParts parts, int wrap_nodes);

/// Default distance between wrapping and surface, relative to the edge.
inline constexpr double usual_wrap_offset = 0.05;

/// Closed surface without self-intersections around a broken one, at a distance of `offset` times `edge`
/// [unit of the surface]; gaps narrower than half of `edge` are bridged (CGAL's Alpha_wrap_3), in a child
/// process. Throws Error (where = `where`) if the parts are apart, and if CGAL fails.
TriangleSurface wrapped_surface(const TriangleSurface& surface, double edge, double offset,
                                const std::string& where);

/// Mean edge of a surface mesh of equilateral triangles with so many nodes on this area: there are two
/// triangles of area sqrt(3)/4 edge^2 per node. [unit of sqrt(area)]
double edge_for_nodes(double area, double nodes);

/// Text of an OFF file of a surface; reads back as the same numbers.
std::string off_text(const TriangleSurface& surface);

}  // namespace palpate
