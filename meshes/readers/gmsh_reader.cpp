// Gmsh .msh 2.2 and 4.1 (ASCII). Format: Gmsh reference manual, "MSH file format".
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <map>
#include <string>
#include <unordered_map>

#include "meshes/readers/volume_mesh_readers.h"

namespace palpate {
namespace {

/// The element of a Gmsh type number, with Gmsh's order of nodes; null for types that are not read.
const FileElement* find_element(std::int64_t type) {
  static const std::map<std::int64_t, FileElement> elements = {
      {1, {ElementType::line2}},
      {2, {ElementType::tri3}},
      {3, {ElementType::quad4}},
      {4, {ElementType::tet4}},
      {5, {ElementType::hex8}},
      {9, {ElementType::tri6}},
      {11, {ElementType::tet10, {0, 1, 2, 3, 4, 5, 6, 7, 9, 8}}}};
  const auto found = elements.find(type);
  return found == elements.end() ? nullptr : &found->second;
}

enum SkippedElement : std::int64_t { quadratic_line = 8, point = 15 };

/// Contents of the sections read so far.
struct GmshMesh {
  MeshFile mesh;
  std::unordered_map<std::int64_t, Index> node_of_tag;  // node tags have gaps
  std::map<std::pair<std::int64_t, std::int64_t>, std::vector<Index>>
      physicals_of_entity;  // 4.1: (dimension, entity tag)
};

void add_node(TextReader& reader, GmshMesh& gmsh, std::int64_t tag, const Vec3& x) {
  if (!gmsh.node_of_tag.emplace(tag, static_cast<Index>(gmsh.mesh.nodes.size())).second) {
    reader.fail(fmt::format("node {} stands twice in the file", tag));
  }
  gmsh.mesh.nodes.push_back(x);
}

Index read_node_by_tag(TextReader& reader, const GmshMesh& gmsh) {
  const std::int64_t tag = reader.integer("a node number");
  const auto found = gmsh.node_of_tag.find(tag);
  if (found == gmsh.node_of_tag.end()) reader.fail(fmt::format("node {} does not exist", tag));
  return found->second;
}

/// Throws Error for a type that is neither read nor skipped.
void check_type(const TextReader& reader, std::int64_t type) {
  if (find_element(type) == nullptr && type != quadratic_line && type != point) {
    fail_unknown_element(reader, fmt::format("elements of Gmsh type {}", type));
  }
}

/// Reads the node list of an element of a type that check_type accepts.
void read_element(TextReader& reader, GmshMesh& gmsh, std::int64_t type, std::span<const Index> physicals) {
  const FileElement* element = find_element(type);
  if (element == nullptr) {
    reader.skip_words(type == point ? 1 : 3, "a node number");
    return;
  }
  std::array<Index, max_element_nodes> nodes{};
  const std::span<Index> used(nodes.data(), static_cast<std::size_t>(traits(element->type).nodes));
  for (Index& node : used) node = read_node_by_tag(reader, gmsh);
  if (physicals.empty()) {
    gmsh.mesh.add(*element, used, 0);
  } else {
    gmsh.mesh.add(*element, used, physicals.front(), physicals.subspan(1));
  }
}

void read_nodes_2(TextReader& reader, GmshMesh& gmsh, bool parametric) {
  const std::int64_t count = reader.count("the number of nodes", 4);
  for (std::int64_t i = 0; i < count; ++i) {
    const std::int64_t tag = reader.integer("a node number");
    add_node(reader, gmsh, tag, reader.point());
    if (parametric) reader.rest_of_line();  // its entity, and parameters on it
  }
}

void read_elements_2(TextReader& reader, GmshMesh& gmsh) {
  const std::int64_t count = reader.count("the number of elements", 4);
  for (std::int64_t i = 0; i < count; ++i) {
    reader.integer("an element number");
    const std::int64_t type = reader.integer("an element type");
    check_type(reader, type);
    const std::int64_t tags = reader.count("the number of tags", 1);
    const Index physical = tags > 0 ? reader.tag() : 0;  // the first tag is the physical group
    if (tags > 1) reader.skip_words(tags - 1, "a tag");
    read_element(reader, gmsh, type, {&physical, 1});
  }
}

/// Merges duplicates: format 2.2 lists an element once for each of its groups.
void unite_groups(FileElements& elements, std::size_t width) {
  if (std::ranges::adjacent_find(elements.tags, std::not_equal_to<>()) == elements.tags.end()) return;
  std::map<std::vector<Index>, std::size_t> first;  // by nodes
  FileElements united;
  for (std::size_t e = 0; e < elements.tags.size(); ++e) {
    const std::span<const Index> nodes(elements.nodes.data() + width * e, width);
    const auto [known, is_new] = first.try_emplace({nodes.begin(), nodes.end()}, united.tags.size());
    const Index tag = elements.tags[e];
    if (!is_new && tag != 0 && tag != united.tags[known->second]) {
      united.more_tags.emplace_back(known->second, tag);
      continue;
    }
    united.nodes.insert(united.nodes.end(), nodes.begin(), nodes.end());
    united.tags.push_back(tag);
  }
  elements = std::move(united);
}

/// Reads the names of groups: dimension, number and name in quotes.
void read_names(TextReader& reader, GmshMesh& gmsh) {
  const std::int64_t count = reader.count("the number of names", 3);
  for (std::int64_t i = 0; i < count; ++i) {
    const auto dimension = static_cast<int>(reader.integer("a dimension", 0, 3));
    const Index number = reader.tag();
    std::string_view name = reader.rest_of_line();
    name.remove_prefix(std::min(name.find('"') + 1, name.size()));
    gmsh.mesh.names.emplace(std::pair(dimension, std::string(name.substr(0, name.rfind('"')))), number);
  }
}

/// Reads the physical groups of each curve, surface and volume; of partitioned ones those of each part.
void read_entities(TextReader& reader, GmshMesh& gmsh, bool parts) {
  std::array<std::int64_t, 4> counts{};
  if (parts) {
    reader.integer("the number of partitions");
    reader.skip_words(2 * reader.count("the number of ghost entities", 2), "a ghost entity");
  }
  for (std::int64_t& count : counts) count = reader.count("the number of entities", 5);
  for (std::size_t dimension = 0; dimension < 4; ++dimension) {
    for (std::int64_t i = 0; i < counts[dimension]; ++i) {
      const std::int64_t tag = reader.integer("an entity number");
      if (parts) {
        reader.skip_words(2, "the entity that it is part of");
        reader.skip_words(reader.count("the number of its partitions", 1), "a partition");
      }
      reader.skip_words(dimension == 0 ? 3 : 6, "a bound");
      const std::int64_t physicals = reader.count("the number of physical groups", 1);
      for (std::int64_t p = 0; p < physicals; ++p) {
        gmsh.physicals_of_entity[{static_cast<std::int64_t>(dimension), tag}].push_back(
            std::abs(reader.tag()));  // the sign is an orientation
      }
      if (dimension > 0)
        reader.skip_words(reader.count("the number of bounding entities", 1), "an entity number");
    }
  }
}

void read_nodes_4(TextReader& reader, GmshMesh& gmsh) {
  const std::int64_t blocks = reader.count("the number of blocks", 4);
  const std::int64_t count = reader.count("the number of nodes", 4);
  reader.skip_words(2, "a node number");
  for (std::int64_t block = 0; block < blocks; ++block) {
    const std::int64_t dimension = reader.integer("a dimension", 0, 3);
    reader.integer("an entity number");
    const bool parametric = reader.integer("whether nodes have parameters", 0, 1) == 1;
    std::vector<std::int64_t> tags(
        static_cast<std::size_t>(reader.count("the number of nodes in the block", 4)));
    for (std::int64_t& tag : tags) tag = reader.integer("a node number");
    for (const std::int64_t tag : tags) {
      add_node(reader, gmsh, tag, reader.point());
      if (parametric) reader.skip_words(dimension, "a parameter");
    }
  }
  if (static_cast<std::int64_t>(gmsh.mesh.nodes.size()) != count) {
    reader.fail(fmt::format("the blocks hold {} nodes, not {}", gmsh.mesh.nodes.size(), count));
  }
}

void read_elements_4(TextReader& reader, GmshMesh& gmsh) {
  const std::int64_t blocks = reader.count("the number of blocks", 4);
  const std::int64_t count = reader.count("the number of elements", 2);
  reader.skip_words(2, "an element number");
  std::int64_t read = 0;
  for (std::int64_t block = 0; block < blocks; ++block) {
    const std::int64_t dimension = reader.integer("a dimension", 0, 3),
                       entity = reader.integer("an entity number");
    const std::vector<Index>& physicals = gmsh.physicals_of_entity[{dimension, entity}];
    const std::int64_t type = reader.integer("an element type");
    check_type(reader, type);
    const std::int64_t in_block = reader.count("the number of elements in the block", 2);
    for (std::int64_t i = 0; i < in_block; ++i) {
      reader.integer("an element number");
      read_element(reader, gmsh, type, physicals);
    }
    read += in_block;
  }
  if (read != count) reader.fail(fmt::format("the blocks hold {} elements, not {}", read, count));
}

/// Major version of the format, 2 or 4.
int read_format(TextReader& reader) {
  reader.expect("$MeshFormat");
  const std::string version(reader.word("the format's version"));
  if (version != "2.2" && version != "2.1" && version != "2" && version != "4.1") {
    reader.fail(fmt::format("the Gmsh format's version is {:.40}, but only 2.2 and 4.1 are read", version),
                "Write it again: gmsh -save -format msh41 -o new.msh old.msh");
  }
  if (reader.integer("the file type", 0, 1) == 1) {
    reader.fail("the file is binary; only text is read",
                "Save it as ASCII: Mesh.Binary = 0, or gmsh -save -format msh41 -o new.msh old.msh");
  }
  reader.integer("the size of a number");
  reader.expect("$EndMeshFormat");
  return version == "4.1" ? 4 : 2;
}

void skip_section(TextReader& reader, const std::string& end) {
  while (reader.peek() != end) reader.word(end.c_str());
}

}  // namespace

std::pair<Mesh, MeshGroups> read_gmsh(const std::filesystem::path& file) {
  TextReader reader(file);
  const int version = read_format(reader);
  GmshMesh gmsh;
  while (!reader.at_end()) {
    const std::string name(reader.word("a section"));
    if (name.front() != '$') reader.fail_on(name, "a section");
    const std::string end = fmt::format("$End{}", name.substr(1));
    if (name == "$Nodes" && version == 4) {
      read_nodes_4(reader, gmsh);
    } else if (name == "$Nodes" || name == "$ParametricNodes") {
      read_nodes_2(reader, gmsh, name == "$ParametricNodes");
    } else if (name == "$Elements") {
      (version == 4 ? read_elements_4 : read_elements_2)(reader, gmsh);
    } else if ((name == "$Entities" || name == "$PartitionedEntities") && version == 4) {
      read_entities(reader, gmsh, name == "$PartitionedEntities");
    } else if (name == "$PhysicalNames") {
      read_names(reader, gmsh);
    } else {
      skip_section(reader, end);
    }
    reader.expect(end);
  }
  if (version == 2) {
    for (const ElementTraits& kind : element_traits)
      unite_groups(gmsh.mesh.elements[static_cast<std::size_t>(kind.type)],
                   static_cast<std::size_t>(kind.nodes));
  }
  return to_body(std::move(gmsh.mesh), reader);
}

}  // namespace palpate
