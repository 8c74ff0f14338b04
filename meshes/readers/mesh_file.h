// Contents of a mesh file, and its body.
#pragma once

#include <array>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "meshes/mesh.h"
#include "meshes/readers/text_reader.h"

namespace palpate {

/// An element type of a file format.
struct FileElement {
  ElementType type;
  /// Place of our node i in the file's list; set only if a format's order is not ours.
  std::array<std::uint8_t, max_element_nodes> place = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
};

/// Elements of one kind.
struct FileElements {
  std::vector<Index> nodes;  ///< [elements * nodes per element]
  std::vector<Index> tags;   ///< [elements] 0 where untagged
  /// Further groups of elements: the element's number and the group's tag.
  std::vector<std::pair<std::size_t, Index>> more_tags{};
};

/// The groups of a body's elements in its file.
struct MeshGroups {
  std::vector<std::pair<std::size_t, Index>> more;  ///< element, and a group of it besides its region
  std::map<std::string, Index> number_of;           ///< by name
  std::string hint;                                 ///< reason why there are none, if not obvious
};

/// Nodes and elements of all kinds, the body's and others.
struct MeshFile {
  std::vector<Vec3> nodes;
  std::array<FileElements, element_traits.size()> elements;  ///< by kind
  std::map<std::pair<int, std::string>, Index> names;        ///< tag of a group by dimension and name
  std::string hint;                                          ///< as in MeshGroups

  /// Adds an element; `in_file` has its node numbers in the file's order.
  void add(const FileElement& element, std::span<const Index> in_file, Index tag,
           std::span<const Index> more_tags = {});
};

/// The body: elements of the highest dimension, with tagged elements of one dimension less as tagged facets
/// (the middles of their edges are looked up if the file gives none). A plane mesh is moved to z = 0. Throws
/// Error at the reader's place if there are no nodes or no elements, elements of several kinds, triangles or
/// quadrilaterals that do not lie in a plane of equal z, or tagged facets that are not sides of the elements.
std::pair<Mesh, MeshGroups> to_body(MeshFile file, const TextReader& reader);

/// Throws Error at the reader's place for an element of a kind that bodies are not made of.
[[noreturn]] void fail_unknown_element(const TextReader& reader, const std::string& kind);

}  // namespace palpate
