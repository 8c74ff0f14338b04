// Tetrahedra inside a closed surface, by CGAL Mesh_3.
#pragma once

#include <string>

#include "meshes/mesh.h"
#include "precompute/description/description.h"
#include "precompute/surfaces/surface_input.h"

namespace palpate {

/// Meshes the inside of a closed surface anew, in a child process: edges whose faces turn by more than
/// options.feature_angle are kept, as are the corners where they meet; everywhere else new nodes stay within
/// options.facet_distance of the surface. The target edge length at depth d is h_s + grading d, h_s the
/// edge_length or else the mean edge of the surface. Lengths of `options` and of the surface are in the same
/// unit. The same input gives the same mesh. Throws Error (where = `where`) when CGAL finds no mesh.
Mesh mesh_surface_with_cgal(const TriangleSurface& surface, const MeshOptions& options,
                            const std::string& where);

}  // namespace palpate
