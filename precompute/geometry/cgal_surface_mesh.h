// Tetrahedra inside a closed surface, by CGAL Mesh_3.
#pragma once

#include <string>

#include "meshes/mesh.h"
#include "precompute/description/description.h"
#include "precompute/surfaces/surface_input.h"

namespace palpate {

/// Meshes the inside of a closed surface in a child process; the surface is remeshed, too. Edges with an
/// angle above options.feature_angle between their faces are kept, as are the corners where they meet;
/// everywhere else new nodes stay within options.facet_distance of the surface. The target edge length at
/// depth d is h_s + grading d, with h_s the edge_length or else the mean edge of the surface. `options` and
/// the surface have the same unit of length. The same input gives the same mesh. Throws Error
/// (where = `where`) if CGAL finds no mesh.
Mesh mesh_surface_with_cgal(const TriangleSurface& surface, const MeshOptions& options,
                            const std::string& where);

}  // namespace palpate
