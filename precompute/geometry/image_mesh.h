// Tetrahedra from a labelled image.
#pragma once

#include <string>
#include <vector>

#include "meshes/mesh.h"
#include "precompute/description/description.h"

namespace palpate {

/// Meshes the selected labels of an image as one body: its boundary by CGAL's Mesh_3, its inside also by
/// Mesh_3 or by TetGen. With `image.regions` the mesh follows the interfaces between labels, the elements'
/// regions are the labels, and `notes` reports each label's volume in the mesh and in the image; otherwise
/// all regions are 0. The target edge length at depth d below boundary and interfaces is
/// edge_length + grading d. Lengths of `options` are in the image's unit, edge_length is required. The same
/// input gives the same mesh. `notes` also reports parts lost because they are one voxel thick, and lost
/// volume. Throws Error for a file that is not an image, labels that it does not have, a body of several
/// large parts or of parts that are too thin, and if the mesher fails.
Mesh mesh_image(const ImageGeometry& image, const MeshOptions& options, std::vector<std::string>& notes);

}  // namespace palpate
