// Tetrahedra inside a closed surface, by TetGen.
#pragma once

#include <string>
#include <vector>

#include "meshes/mesh.h"
#include "precompute/description/description.h"
#include "precompute/geometry/mesh_parts.h"
#include "precompute/geometry/mesh_size.h"
#include "precompute/surfaces/surface_input.h"

namespace palpate {

/// Meshes the inside of a closed surface with Hang Si's TetGen, in a child process. The surface is not
/// changed; the target edge length at depth d below it is h_s + grading d, with h_s the edge_length or else
/// the mean edge of the surface. `options` and the surface have the same unit of length. Throws Error
/// (where = `where`) if TetGen refuses, crashes or does not end.
Mesh mesh_surface(const TriangleSurface& surface, const MeshOptions& options, const std::string& where);

/// Meshes walls that enclose several parts, which may have walls in common: the elements of a part get the
/// region of the point in it; a part without a point is left empty. `size` is the expected size of the mesh.
Mesh mesh_regions(const TriangleSurface& walls, const std::vector<RegionPoint>& points,
                  const MeshOptions& options, const MeshSize& size, const std::string& where);

}  // namespace palpate
