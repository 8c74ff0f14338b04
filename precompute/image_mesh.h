// Tetrahedra from a labelled image, by CGAL Mesh_3.
#pragma once

#include <string>
#include <vector>

#include "meshes/mesh.h"
#include "precompute/description.h"

namespace palpate {

/// Meshes the selected labels of an image as one body. Target edge length edge_length at the surface,
/// edge_length + grading d at depth d below it. Lengths of `options` are in the image's unit, edge_length is
/// required. The same input gives the same mesh. Throws Error for a file that is not an image, labels that it
/// does not hold, and a body in several large parts.
Mesh mesh_image(const ImageGeometry& image, const MeshOptions& options, std::vector<std::string>& notes);

}  // namespace palpate
