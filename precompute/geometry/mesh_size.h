// Expected size of a mesh, and limits for its mesher.
#pragma once

#include <string>

#include "base/child_process.h"
#include "precompute/description/description.h"
#include "precompute/images/voxel_body.h"
#include "precompute/surfaces/surface_input.h"

namespace palpate {

/// Expected number of tetrahedra from a mesher, and of facets of the given boundary. Both are rough.
struct MeshSize {
  double elements = 0.0;
  double facets = 0.0;
};

/// Number of regular tetrahedra of edge length edge_length + grading d at depth d that fill a slab of this
/// volume whose sides together have this area > 0.
double expected_elements(double volume, double area, double edge_length, double grading);

/// Number of nodes of regular triangles of edge length edge_length + grading d at depth d that fill a strip
/// of this area whose sides together have this length > 0.
double expected_plane_nodes(double area, double length, double edge_length, double grading);

/// Expected size of the mesh of a surface or image. Lengths of `options` are in the unit of the body.
MeshSize expected_size(const TriangleSurface& surface, const MeshOptions& options);
MeshSize expected_size(const VoxelBody& body, const MeshOptions& options);

/// Throws Error (where = `where`) if a mesh of so many elements takes more memory than this process may have
/// until its plan is known: the mesh, its checks, K and the symbolic analysis.
void check_mesh_room(double elements, ElementType element, const std::string& where);

/// A rounded count for messages: "some 2e+07".
std::string shown_count(double count);

/// Limits for a mesher, meant to be far above the needs of a mesh of that size. Throws Error if the mesh
/// would have more elements than can be computed with (where = `where`).
ChildLimits meshing_limits(const MeshSize& size, const MeshOptions& options, const std::string& where);

}  // namespace palpate
