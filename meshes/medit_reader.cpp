// Medit .mesh (ASCII): keyword, count, and so many lines. Format: Frey, "MEDIT: an interactive mesh
// visualization software", INRIA RT-0253, 2001.
#include <cctype>
#include <set>
#include <string>

#include "meshes/volume_mesh_readers.h"

namespace palpate {
namespace {

void read_vertices(TextReader& reader, Mesh& mesh) {
  const std::int64_t count = reader.count("the number of vertices", 4);
  mesh.nodes.reserve(static_cast<std::size_t>(count));
  for (std::int64_t i = 0; i < count; ++i) {
    mesh.nodes.push_back(reader.point());
    reader.tag();
  }
}

void read_triangles(TextReader& reader, Mesh& mesh) {
  const std::int64_t count = reader.count("the number of triangles", 4);
  for (std::int64_t i = 0; i < count; ++i) {
    const Triangle nodes = read_corners<3>(reader, mesh, 1);
    const Index tag = reader.tag();
    if (tag != 0) mesh.tagged_boundary.push_back({nodes, tag});
  }
}

void read_tetrahedra(TextReader& reader, Mesh& mesh) {
  const std::int64_t count = reader.count("the number of tetrahedra", 5);
  for (std::int64_t i = 0; i < count; ++i) {
    mesh.tets.push_back(read_corners<4>(reader, mesh, 1));
    mesh.regions.push_back(reader.tag());
  }
}

/// Edges, corners, normals, ...: numbers up to the next keyword.
void skip_section(TextReader& reader) {
  while (!reader.at_end() && std::isalpha(static_cast<unsigned char>(reader.peek().front())) == 0) {
    reader.word("a number");
  }
}

}  // namespace

Mesh read_medit(const std::filesystem::path& file) {
  static const std::set<std::string, std::less<>> other_elements = {
      "Hexahedra", "Prisms", "Pyramids", "Wedges", "TetrahedraP2", "HexahedraQ2"};
  TextReader reader(file, '#');
  reader.expect("MeshVersionFormatted");
  reader.integer("the format's version", 1, 4);
  Mesh mesh;
  while (!reader.at_end()) {
    const std::string keyword(reader.word("a keyword"));
    if (keyword == "End") break;
    if (keyword == "Dimension") {
      if (reader.integer("the dimension") != 3) {
        reader.fail("the mesh is not three-dimensional", "Save a volume mesh (Dimension 3).");
      }
    } else if (keyword == "Vertices") {
      read_vertices(reader, mesh);
    } else if (keyword == "Triangles") {
      read_triangles(reader, mesh);
    } else if (keyword == "Tetrahedra") {
      read_tetrahedra(reader, mesh);
    } else if (other_elements.contains(keyword)) {
      if (reader.count("the number of elements", 1) > 0) fail_not_tet4(reader, keyword);
    } else if (std::isalpha(static_cast<unsigned char>(keyword.front())) != 0) {
      skip_section(reader);
    } else {
      reader.fail_on(keyword, "a keyword");
    }
  }
  check_not_empty(mesh, reader);
  return mesh;
}

}  // namespace palpate
