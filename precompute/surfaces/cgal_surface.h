// Surfaces in CGAL's data structures.
#pragma once

#include <CGAL/Surface_mesh.h>

#include "precompute/surfaces/polygon_soup.h"
#include "precompute/surfaces/triangle_surface.h"

namespace palpate {

/// Nodes and triangles as points and polygons.
PolygonSoup soup_of(const TriangleSurface& surface);

/// Nodes and triangles of a mesh without removed elements.
TriangleSurface surface_of(const CGAL::Surface_mesh<PolygonSoup::Point>& mesh);

/// A manifold surface as a mesh.
CGAL::Surface_mesh<PolygonSoup::Point> mesh_of(const TriangleSurface& surface);

}  // namespace palpate
