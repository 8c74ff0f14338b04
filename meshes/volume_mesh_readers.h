// One reader a mesh file format; read_volume_mesh chooses.
#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "meshes/mesh.h"
#include "meshes/text_reader.h"

namespace palpate {

/// Each throws Error with file and line. Facets and elements without a tag, or with tag 0, count as untagged.
Mesh read_gmsh(const std::filesystem::path& file);        ///< .msh, 2.2 and 4.1 ASCII
Mesh read_medit(const std::filesystem::path& file);       ///< .mesh, ASCII
Mesh read_tetgen(const std::filesystem::path& stem);      ///< stem.node, stem.ele and, if there, stem.face
Mesh read_vtk_legacy(const std::filesystem::path& file);  ///< .vtk, ASCII unstructured grid

/// Throws Error at the reader's place unless the mesh has nodes and tetrahedra.
void check_not_empty(const Mesh& mesh, const TextReader& reader);

/// Throws Error at the reader's place: an element that is not a linear tetrahedron.
[[noreturn]] void fail_not_tet4(const TextReader& reader, const std::string& kind);

/// The N node numbers of an element or facet, counted from `first` in the file, from 0 in the result.
template <std::size_t N>
std::array<Index, N> read_corners(TextReader& reader, const Mesh& mesh, std::int64_t first) {
  std::array<Index, N> corners{};
  const auto last = first + static_cast<std::int64_t>(mesh.nodes.size()) - 1;
  for (Index& corner : corners)
    corner = static_cast<Index>(reader.integer("a node number", first, last) - first);
  return corners;
}

}  // namespace palpate
