// TetGen .node, .ele and .face. Format: Si, TetGen manual 1.5, section 5.
#include <cmath>
#include <limits>

#include "meshes/volume_mesh_readers.h"

namespace palpate {
namespace {

std::filesystem::path with_ending(std::filesystem::path stem, const char* ending) {
  return stem += ending;
}

/// TetGen writes the attribute of a region as a real number.
Index read_region(TextReader& reader) {
  const double value = reader.number("a region attribute");
  if (value != std::round(value) || std::abs(value) > std::numeric_limits<Index>::max()) {
    reader.fail("the region attribute is not a whole number",
                "Give regions whole numbers in the .poly file.");
  }
  return static_cast<Index>(value);
}

/// Reads the nodes and returns the number of the first, 0 or 1.
std::int64_t read_nodes(const std::filesystem::path& file, Mesh& mesh) {
  TextReader reader(file, '#');
  const std::int64_t count = reader.count("the number of nodes", 4);
  if (reader.integer("the dimension") != 3)
    reader.fail("the mesh is not three-dimensional", "Give a TetGen .node file.");
  reader.rest_of_line();
  std::int64_t first = 0;
  mesh.nodes.reserve(static_cast<std::size_t>(count));
  for (std::int64_t i = 0; i < count; ++i) {
    if (i == 0) first = reader.integer("the first node number", 0, 1);
    if (i > 0) reader.integer("the next node number", first + i, first + i);
    mesh.nodes.push_back(reader.point());
    reader.rest_of_line();  // attributes and marker
  }
  if (count == 0) reader.fail("the file has no nodes");
  return first;
}

void read_elements(const std::filesystem::path& file, std::int64_t first, Mesh& mesh) {
  TextReader reader(file, '#');
  const std::int64_t count = reader.count("the number of tetrahedra", 5);
  if (reader.integer("the number of nodes of an element") != 4) {
    fail_not_tet4(reader, "elements of second order");
  }
  const bool has_region = reader.integer("the number of region attributes", 0, 1) == 1;
  for (std::int64_t i = 0; i < count; ++i) {
    reader.integer("an element number");
    mesh.tets.push_back(read_corners<4>(reader, mesh, first));
    mesh.regions.push_back(has_region ? read_region(reader) : 0);
  }
  check_not_empty(mesh, reader);
}

void read_faces(const std::filesystem::path& file, std::int64_t first, Mesh& mesh) {
  TextReader reader(file, '#');
  const std::int64_t count = reader.count("the number of faces", 4);
  if (reader.integer("whether faces have markers", 0, 1) == 0) return;
  for (std::int64_t i = 0; i < count; ++i) {
    reader.integer("a face number");
    const Triangle nodes = read_corners<3>(reader, mesh, first);
    const Index tag = reader.tag();
    if (tag != 0) mesh.tagged_boundary.push_back({nodes, tag});
    reader.rest_of_line();  // with TetGen -nn the elements beside the face
  }
}

}  // namespace

Mesh read_tetgen(const std::filesystem::path& stem) {
  Mesh mesh;
  const std::int64_t first = read_nodes(with_ending(stem, ".node"), mesh);
  read_elements(with_ending(stem, ".ele"), first, mesh);
  const std::filesystem::path faces = with_ending(stem, ".face");
  if (std::filesystem::exists(faces)) read_faces(faces, first, mesh);
  return mesh;
}

}  // namespace palpate
