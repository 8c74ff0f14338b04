// Triangles from a black-and-white picture.
#pragma once

#include <string>
#include <vector>

#include "meshes/mesh.h"
#include "precompute/description/description.h"

namespace palpate {

/// Meshes the pixels of a picture that are not black, each a square of one unit: keeps its one body, smooths
/// the staircase of pixels around it and its holes to lines within about a pixel (or a twentieth of
/// edge_length, if that is more) of it, and meshes these as mesh_polygon does. Lengths of `options` are in
/// pixels, edge_length is required. The same input gives the same mesh. Throws Error for a file that is no
/// picture and for a picture with no body, several or touching ones.
Mesh mesh_picture(const PictureGeometry& picture, const MeshOptions& options,
                  std::vector<std::string>& notes);

}  // namespace palpate
