// Closed triangle surfaces from files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "precompute/surfaces/triangle_surface.h"

namespace palpate {

/// Reads OFF, OBJ, STL (ASCII and binary) or PLY by the file's extension, splits polygons into triangles and
/// turns triangles outwards. Repairs are told in `notes`. Throws Error with the coordinates when the surface
/// is open, not manifold, flat, of several bodies, or intersects itself; the triangles that intersect are
/// then written to NAME.bad-faces.off in the working directory, with `keep` only where nothing has that name.
/// File and surface are read by foreign code in a child process, which has the limits of reading_limits.
TriangleSurface read_surface(const std::filesystem::path& file, std::vector<std::string>& notes,
                             bool keep = false);

/// A remeshed surface, or what is wrong with it.
struct Remeshing {
  TriangleSurface surface;
  std::string problem;  ///< empty where the surface can be meshed; else the rest of "the surface ..."
};

/// Remeshes the surface of a file isotropically to `edge_length` (file units), edges sharper than 60 degrees
/// kept, in a child process. `surface` is what read_surface made of the same file. Throws Error when
/// there would be too many triangles, and as read_surface does.
Remeshing remesh_surface(const std::filesystem::path& file, const TriangleSurface& surface,
                         double edge_length);

}  // namespace palpate
