// Meshes made elsewhere.
#pragma once

#include <filesystem>

#include "meshes/readers/mesh_file.h"

namespace palpate {

/// Reads Gmsh .msh (2.2 and 4.1 ASCII), Medit .mesh, TetGen .node/.ele (either name, or the stem) or legacy
/// VTK .vtk (ASCII), by the file's extension: tet4, tet10 or hex8 elements, or a plane mesh of tri3 or quad4
/// (same z everywhere, moved to z = 0). Coordinates as in the file. An element's region is its group, the
/// first where it is in several; `groups` gets the others and their names. Throws Error naming file and line.
Mesh read_volume_mesh(const std::filesystem::path& file, MeshGroups* groups = nullptr);

/// The files that it reads: two of a TetGen mesh.
std::vector<std::filesystem::path> volume_mesh_files(const std::filesystem::path& file);

}  // namespace palpate
