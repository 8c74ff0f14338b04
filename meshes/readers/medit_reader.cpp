// Medit .mesh (ASCII): keyword, count, and so many lines. Format: Frey, "MEDIT: an interactive mesh
// visualization software", INRIA RT-0253, 2001.
#include <cctype>
#include <map>
#include <set>
#include <string>

#include "meshes/readers/volume_mesh_readers.h"

namespace palpate {
namespace {

struct Section {
  const char* count_name;
  FileElement element;
};

const std::map<std::string, Section, std::less<>>& element_sections() {
  static const std::map<std::string, Section, std::less<>> sections = {
      {"Edges", {"the number of edges", {ElementType::line2}}},
      {"Triangles", {"the number of triangles", {ElementType::tri3}}},
      {"Quadrilaterals", {"the number of quadrilaterals", {ElementType::quad4}}},
      {"Tetrahedra", {"the number of tetrahedra", {ElementType::tet4}}},
      {"Hexahedra", {"the number of hexahedra", {ElementType::hex8}}}};
  return sections;
}

void read_vertices(TextReader& reader, std::int64_t dimension, MeshFile& mesh) {
  const std::int64_t count = reader.count("the number of vertices", dimension + 1);
  mesh.nodes.reserve(static_cast<std::size_t>(count));
  for (std::int64_t i = 0; i < count; ++i) {
    mesh.nodes.push_back(dimension == 3 ? reader.point() : reader.plane_point());
    reader.tag();
  }
}

void read_elements(TextReader& reader, const Section& section, MeshFile& mesh) {
  const std::int64_t count = reader.count(section.count_name, traits(section.element.type).nodes + 1);
  for (std::int64_t i = 0; i < count; ++i) {
    read_element(reader, mesh, section.element, 1, [&] { return reader.tag(); });
  }
}

/// Skips corners, ridges, normals, ...: numbers up to the next keyword.
void skip_section(TextReader& reader) {
  while (!reader.at_end() && std::isalpha(static_cast<unsigned char>(reader.peek().front())) == 0) {
    reader.word("a number");
  }
}

}  // namespace

std::pair<Mesh, MeshGroups> read_medit(const std::filesystem::path& file) {
  static const std::set<std::string, std::less<>> other_elements = {
      "Prisms", "Pyramids", "Wedges", "TrianglesP2", "QuadrilateralsQ2", "TetrahedraP2", "HexahedraQ2"};
  TextReader reader(file, '#');
  reader.expect("MeshVersionFormatted");
  reader.integer("the format's version", 1, 4);
  std::int64_t dimension = 3;
  MeshFile mesh;
  while (!reader.at_end()) {
    const std::string keyword(reader.word("a keyword"));
    const auto section = element_sections().find(keyword);
    if (keyword == "End") break;
    if (keyword == "Dimension") {
      dimension = reader.integer("the dimension", 2, 3);
    } else if (keyword == "Vertices") {
      read_vertices(reader, dimension, mesh);
    } else if (section != element_sections().end()) {
      read_elements(reader, section->second, mesh);
    } else if (other_elements.contains(keyword)) {
      if (reader.count("the number of elements", 1) > 0) fail_unknown_element(reader, keyword);
    } else if (std::isalpha(static_cast<unsigned char>(keyword.front())) != 0) {
      skip_section(reader);
    } else {
      reader.fail_on(keyword, "a keyword");
    }
  }
  return to_body(std::move(mesh), reader);
}

}  // namespace palpate
