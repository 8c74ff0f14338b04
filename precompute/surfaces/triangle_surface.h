// A surface of triangles, and its measures.
#pragma once

#include <functional>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Closed, manifold surface of one body without self-intersections, oriented outwards, in the file's length
/// unit: one shell, and others in it around cavities (shells.h).
struct TriangleSurface {
  std::vector<Vec3> nodes;
  std::vector<Triangle> triangles;
};

/// Area of the triangles.
double area(const TriangleSurface& surface);

/// Volume inside, positive if the triangles are oriented outwards.
double enclosed_volume(const TriangleSurface& surface);

/// Mean length of the triangles' edges.
double mean_edge_length(const TriangleSurface& surface);

/// Distance of a point from the surface.
std::function<double(const Vec3&)> distance_to(const TriangleSurface& surface);

}  // namespace palpate
