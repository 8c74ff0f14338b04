// Closed triangle surfaces from files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "precompute/surfaces/triangle_surface.h"

namespace palpate {

/// Reads OFF, OBJ, STL (ASCII and binary) or PLY by the file's extension, splits polygons into triangles and
/// orients them outwards. Repairs are reported in `notes`. Throws Error with the coordinates if the surface
/// is open, not manifold, flat, of several bodies, or intersects itself; intersecting triangles are then
/// written to NAME.bad-faces.off in the working directory, with `keep` only if that name is free. Third-party
/// code reads file and surface in a child process with the limits of reading_limits.
TriangleSurface read_surface(const std::filesystem::path& file, std::vector<std::string>& notes,
                             bool keep = false);

/// A remeshed surface, or its defect.
struct Remeshing {
  TriangleSurface surface;
  std::string problem;  ///< empty if the surface can be meshed; else the rest of "the surface ..."
};

/// Remeshes the surface of a file isotropically to `edge_length` (file units), keeping edges sharper than 60
/// degrees, in a child process. `surface` is the result of read_surface for the same file. Throws Error if
/// there would be too many triangles, and as read_surface does.
Remeshing remesh_surface(const std::filesystem::path& file, const TriangleSurface& surface,
                         double edge_length);

}  // namespace palpate
