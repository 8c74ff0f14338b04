// Readers of one mesh file format each; read_volume_mesh chooses.
#pragma once

#include <filesystem>

#include "meshes/readers/mesh_file.h"

namespace palpate {

/// Reads a mesh. Throws Error with file and line. Facets and elements without a tag, or with tag 0, count as
/// untagged.
std::pair<Mesh, MeshGroups> read_gmsh(const std::filesystem::path& file);   ///< .msh, 2.2 and 4.1 ASCII
std::pair<Mesh, MeshGroups> read_medit(const std::filesystem::path& file);  ///< .mesh, ASCII
std::pair<Mesh, MeshGroups> read_tetgen(
    const std::filesystem::path& stem);  ///< stem.node, stem.ele and, if there, stem.face
std::pair<Mesh, MeshGroups> read_vtk_legacy(
    const std::filesystem::path& file);  ///< .vtk, ASCII unstructured grid

/// A file of a set named by a common stem, "liver" for liver.node and liver.ele. The ending is in capitals if
/// only a file of that name exists.
std::filesystem::path with_ending(const std::filesystem::path& stem, const char* ending);

/// Adds an element whose node numbers, counted from `first`, come next in the file; `read_tag` reads its tag.
template <class ReadTag>
void read_element(TextReader& reader, MeshFile& file, const FileElement& element, std::int64_t first,
                  ReadTag read_tag) {
  std::array<Index, max_element_nodes> nodes{};
  const std::span<Index> used(nodes.data(), static_cast<std::size_t>(traits(element.type).nodes));
  const auto last = first + static_cast<std::int64_t>(file.nodes.size()) - 1;
  for (Index& node : used) node = static_cast<Index>(reader.integer("a node number", first, last) - first);
  file.add(element, used, read_tag());
}

}  // namespace palpate
