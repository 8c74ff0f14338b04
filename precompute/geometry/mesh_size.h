// How large a mesh will be, and what its mesher may use.
#pragma once

#include <string>

#include "base/child_process.h"
#include "precompute/description/description.h"
#include "precompute/images/voxel_body.h"
#include "precompute/surfaces/surface_input.h"

namespace palpate {

/// Tetrahedra that a mesher is expected to make, and facets that the boundary was given by. Both are rough.
struct MeshSize {
  double elements = 0.0;
  double facets = 0.0;
};

/// Regular tetrahedra of edge length (edge_length + grading d) at depth d that fill a slab of this volume
/// whose sides together have this area > 0.
double expected_elements(double volume, double area, double edge_length, double grading);

/// Nodes of regular triangles of edge length (edge_length + grading d) at depth d that fill a strip of this
/// area whose sides together have this length > 0.
double expected_plane_nodes(double area, double length, double edge_length, double grading);

/// What a mesher will make of a surface or image. Lengths of `options` are in the unit of the body.
MeshSize expected_size(const TriangleSurface& surface, const MeshOptions& options);
MeshSize expected_size(const VoxelBody& body, const MeshOptions& options);

/// Throws Error (where = `where`) where a mesh of so many elements takes more memory than this process may
/// have, until its plan is known: the mesh, the checks on it, K and its symbolic analysis.
void check_mesh_room(double elements, ElementType element, const std::string& where);

/// "some 2e+07", for messages.
std::string shown_count(double count);

/// Limits on a mesher, meant to be far above what a mesh of that size takes. Throws Error
/// when the mesh would have more elements than can be computed with (where = `where`).
ChildLimits meshing_limits(const MeshSize& size, const MeshOptions& options, const std::string& where);

}  // namespace palpate
