// TetGen .node, .ele and .face. Format: Si, TetGen manual 1.5, section 5.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

#include "meshes/readers/volume_mesh_readers.h"

namespace palpate {

std::filesystem::path with_ending(const std::filesystem::path& stem, const char* ending) {
  std::filesystem::path usual = stem, capitals = stem;
  usual += ending;
  std::string letters = ending;
  std::ranges::transform(letters, letters.begin(), [](unsigned char c) { return std::toupper(c); });
  capitals += letters;
  std::error_code none;
  return !std::filesystem::exists(usual, none) && std::filesystem::exists(capitals, none) ? capitals : usual;
}

namespace {

/// Reads a region attribute, which TetGen writes as a real number.
Index read_region(TextReader& reader) {
  const double value = reader.number("a region attribute");
  if (value != std::round(value) || std::abs(value) > std::numeric_limits<Index>::max()) {
    reader.fail("the region attribute is not a whole number", "Give regions whole numbers in the .poly file");
  }
  return static_cast<Index>(value);
}

/// Reads the nodes and returns the number of the first.
std::int64_t read_nodes(const std::filesystem::path& file, MeshFile& mesh) {
  TextReader reader(file, '#');
  const std::int64_t count = reader.count("the number of nodes", 4);
  if (reader.integer("the dimension") != 3)
    reader.fail("the mesh is not three-dimensional", "Give a TetGen .node file");
  reader.rest_of_line();
  std::int64_t first = 0;
  mesh.nodes.reserve(static_cast<std::size_t>(count));
  for (std::int64_t i = 0; i < count; ++i) {
    if (i == 0) first = reader.integer("the first node number", 0, std::numeric_limits<Index>::max());
    if (i > 0) reader.integer("the next node number", first + i, first + i);
    mesh.nodes.push_back(reader.point());
    reader.rest_of_line();  // attributes and marker
  }
  if (count == 0) reader.fail("the file has no nodes");
  return first;
}

/// Reads faces with a marker. Second-order ones list middles too, opposite to the corners; to_body finds
/// them.
void read_faces(const std::filesystem::path& file, std::int64_t first, MeshFile& mesh) {
  constexpr FileElement triangle = {ElementType::tri3};
  TextReader reader(file, '#');
  const std::int64_t count = reader.count("the number of faces", 4);
  if (reader.integer("whether faces have markers", 0, 1) == 0) return;
  for (std::int64_t i = 0; i < count; ++i) {
    reader.integer("a face number");
    read_element(reader, mesh, triangle, first, [&] {
      // Next on the line: three middles or none, the marker, and with TetGen -nn the two elements beside it.
      if (reader.words_on_line() > 3) reader.skip_words(3, "a node number");
      return reader.tag();
    });
    reader.rest_of_line();
  }
}

/// Reads elements of first order, or of second order with TetGen's middles 23 03 01 12 13 02.
std::pair<Mesh, MeshGroups> read_elements(const std::filesystem::path& file, std::int64_t first,
                                          MeshFile mesh) {
  constexpr FileElement linear = {ElementType::tet4};
  constexpr FileElement quadratic = {ElementType::tet10, {0, 1, 2, 3, 6, 7, 9, 5, 8, 4}};
  TextReader reader(file, '#');
  const std::int64_t count = reader.count("the number of tetrahedra", 5);
  const std::int64_t nodes = reader.integer("the number of nodes of an element");
  if (nodes != 4 && nodes != 10) fail_unknown_element(reader, fmt::format("elements of {} nodes", nodes));
  const std::int64_t attributes = reader.count("the number of region attributes", 0);
  if (attributes > 1)
    reader.fail(fmt::format("the tetrahedra have {} attributes, and one is their region", attributes),
                "Keep the one that is the region, or none");
  const bool has_region = attributes == 1;
  for (std::int64_t i = 0; i < count; ++i) {
    reader.integer("an element number");
    read_element(reader, mesh, nodes == 10 ? quadratic : linear, first,
                 [&] { return has_region ? read_region(reader) : 0; });
  }
  return to_body(std::move(mesh), reader);
}

}  // namespace

std::pair<Mesh, MeshGroups> read_tetgen(const std::filesystem::path& stem) {
  MeshFile mesh;
  const std::int64_t first = read_nodes(with_ending(stem, ".node"), mesh);
  const std::filesystem::path faces = with_ending(stem, ".face");
  std::error_code none;
  if (std::filesystem::exists(faces, none)) read_faces(faces, first, mesh);
  return read_elements(with_ending(stem, ".ele"), first, std::move(mesh));
}

}  // namespace palpate
