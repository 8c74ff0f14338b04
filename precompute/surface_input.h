// Closed triangle surfaces from files.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Closed, manifold, connected surface without self-intersections, oriented outwards, in the file's length
/// unit.
struct TriangleSurface {
  std::vector<Vec3> nodes;
  std::vector<Triangle> triangles;
};

/// Reads OFF, OBJ, STL (ASCII and binary) or PLY by the file's extension, splits polygons into triangles,
/// turns triangles outwards, and remeshes isotropically to `remesh_edge_length` (file units) if that is
/// given, edges sharper than 60 degrees kept. Repairs are told in `notes`. Throws Error with the coordinates
/// when the surface is open, not manifold, flat, in several parts, or intersects itself; the intersecting
/// triangles are then written to NAME.bad-faces.off in the working directory.
TriangleSurface read_surface(const std::filesystem::path& file, std::optional<double> remesh_edge_length,
                             std::vector<std::string>& notes);

/// Mean length of the triangles' edges.
double mean_edge_length(const TriangleSurface& surface);

/// Distance of a point from the surface.
std::function<double(const Vec3&)> distance_to(const TriangleSurface& surface);

}  // namespace palpate
