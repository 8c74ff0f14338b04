// Triangles in the plane from a polygon, by CGAL's Delaunay refinement.
#pragma once

#include <string>
#include <vector>

#include "meshes/mesh.h"
#include "precompute/description/description.h"

namespace palpate {

/// Meshes the area within the outer line and outside the holes with tri3 in z = 0, counter-clockwise. Target
/// edge length edge_length along the lines and edge_length + grading d at distance d from them; shorter edges
/// of the polygon are kept. Angles are at least 20 degrees except at sharper corners of the polygon, which
/// `notes` reports; with `lloyd` inner nodes move towards a centroidal Voronoi diagram. Lengths of `options`
/// are in the polygon's unit, edge_length is required. The same input gives the same mesh. Throws Error
/// (where = `where`) for lines that check_polygon refuses, another kind of element and too many elements.
///
/// Shewchuk, Delaunay refinement algorithms for triangular mesh generation, 2002; Du, Faber and Gunzburger,
/// Centroidal Voronoi tessellations, 1999.
Mesh mesh_polygon(const PolygonGeometry& polygon, const MeshOptions& options, const std::string& where,
                  std::vector<std::string>& notes);

}  // namespace palpate
