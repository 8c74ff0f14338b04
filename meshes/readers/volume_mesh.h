// Volume meshes made by other programs.
#pragma once

#include <filesystem>

#include "meshes/readers/mesh_file.h"

namespace palpate {

/// Reads Gmsh .msh (2.2 and 4.1 ASCII), Medit .mesh, TetGen .node/.ele (either name, or the stem) or legacy
/// VTK .vtk (ASCII), by the file's extension: tet4, tet10 or hex8 elements, or a plane mesh of tri3 or quad4
/// (same z everywhere, moved to z = 0). Coordinates as in the file. An element's region is its first group;
/// `groups` gets the others, and the groups' names. Throws Error naming file and line.
Mesh read_volume_mesh(const std::filesystem::path& file, MeshGroups* groups = nullptr);

/// Files that read_volume_mesh reads: two for a TetGen mesh.
std::vector<std::filesystem::path> volume_mesh_files(const std::filesystem::path& file);

}  // namespace palpate
