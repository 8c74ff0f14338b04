// Legacy VTK unstructured grids (ASCII), both layouts of CELLS: counted lists (up to 4.x) and OFFSETS with
// CONNECTIVITY (5.x). Format: VTK User's Guide, "VTK File Formats".
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "meshes/readers/volume_mesh_readers.h"

namespace palpate {
namespace {

enum SkippedCell : std::int64_t { vertex = 1, poly_vertex = 2, poly_line = 4, quadratic_edge = 21 };

/// Node lists of all cells, of any type.
struct Cells {
  std::vector<Index> nodes;
  std::vector<std::size_t> offsets = {0};  // [cells + 1] into nodes
  std::vector<Index*> tags;                // [cells] of the elements that they have become; null: none
};

/// One value per cell.
struct CellArray {
  std::string name;
  std::vector<Index> values;
};

void read_header(TextReader& reader) {
  if (!reader.rest_of_line().starts_with("# vtk DataFile Version")) {
    reader.fail("the first line is not '# vtk DataFile Version ...'", "Give a legacy VTK file (.vtk)");
  }
  reader.rest_of_line();  // title
  const std::string encoding(reader.word("ASCII"));
  if (encoding == "BINARY") reader.fail("the file is binary; only text is read", "Save it as ASCII");
  if (encoding != "ASCII") reader.fail("the third line is neither ASCII nor BINARY");
}

std::vector<Vec3> read_points(TextReader& reader) {
  std::vector<Vec3> points(static_cast<std::size_t>(reader.count("the number of points", 3)));
  reader.word("the type of the coordinates");
  for (Vec3& x : points) x = reader.point();
  return points;
}

Index read_node(TextReader& reader, std::size_t points) {
  return static_cast<Index>(reader.integer("a node number", 0, static_cast<std::int64_t>(points) - 1));
}

Cells read_counted_lists(TextReader& reader, std::int64_t cell_count, std::size_t points) {
  Cells cells;
  for (std::int64_t cell = 0; cell < cell_count; ++cell) {
    const std::int64_t corners = reader.count("the number of nodes of a cell", 1);
    for (std::int64_t i = 0; i < corners; ++i) cells.nodes.push_back(read_node(reader, points));
    cells.offsets.push_back(cells.nodes.size());
  }
  return cells;
}

Cells read_offsets_and_connectivity(TextReader& reader, std::int64_t offset_count, std::int64_t size,
                                    std::size_t points) {
  Cells cells;
  reader.expect("OFFSETS");
  reader.word("the type of the offsets");
  reader.integer("the first offset", 0, 0);
  for (std::int64_t i = 1; i < offset_count; ++i) {
    const auto before = static_cast<std::int64_t>(cells.offsets.back());
    cells.offsets.push_back(static_cast<std::size_t>(reader.integer("an offset", before, size)));
  }
  reader.expect("CONNECTIVITY");
  reader.word("the type of the connectivity");
  for (std::int64_t i = 0; i < size; ++i) cells.nodes.push_back(read_node(reader, points));
  return cells;
}

Cells read_cells(TextReader& reader, std::size_t points) {
  const std::int64_t count = reader.count("the number of cells", 1),
                     size = reader.count("the size of the cell list", 1);
  if (reader.peek() == "OFFSETS") return read_offsets_and_connectivity(reader, count, size, points);
  return read_counted_lists(reader, count, points);
}

/// Kind of element of a cell type; null if there is none.
const ElementTraits* find_cell_type(std::int64_t type) {
  const auto* const found = std::find_if(element_traits.begin(), element_traits.end(),
                                         [&](const ElementTraits& t) { return t.vtk == type; });
  return found == element_traits.end() ? nullptr : found;
}

/// Number of nodes of a cell type; 0 if it varies. Throws Error for types that are not read.
std::size_t node_count(const TextReader& reader, std::int64_t type) {
  if (const ElementTraits* element = find_cell_type(type)) return static_cast<std::size_t>(element->nodes);
  switch (type) {
    case vertex:
      return 1;
    case quadratic_edge:
      return 3;
    case poly_vertex:
    case poly_line:
      return 0;
    default:
      fail_unknown_element(reader, fmt::format("cells of VTK type {}", type));
  }
}

/// Extracts the elements while reading the cells' types. Sizes are compared for all cells, so that a type cut
/// short (1 of 10) at the end of the file is noticed.
void read_types(TextReader& reader, Cells& cells, MeshFile& mesh) {
  const std::int64_t count = reader.count("the number of cell types", 1);
  if (count != static_cast<std::int64_t>(cells.offsets.size()) - 1) {
    reader.fail(fmt::format("there are {} cell types for {} cells", count, cells.offsets.size() - 1));
  }
  std::vector<const ElementTraits*> kinds;
  for (std::size_t cell = 0; cell + 1 < cells.offsets.size(); ++cell) {
    const std::int64_t type = reader.integer("a cell type");
    const std::size_t first = cells.offsets[cell], nodes = cells.offsets[cell + 1] - first;
    const std::size_t expected = node_count(reader, type);
    if (expected != 0 && nodes != expected) {
      reader.fail(
          fmt::format("cell {} has {} nodes, but its type is {}, which has {}", cell, nodes, type, expected));
    }
    const ElementTraits* const element = find_cell_type(type);
    kinds.push_back(element);
    if (element != nullptr) mesh.add({element->type}, {cells.nodes.data() + first, nodes}, 0);
  }
  cells.tags.clear();
  std::array<std::size_t, element_traits.size()> next{};
  for (const ElementTraits* const element : kinds) {
    const auto kind = element == nullptr ? 0 : static_cast<std::size_t>(element->type);
    cells.tags.push_back(element == nullptr ? nullptr : &mesh.elements.at(kind).tags[next.at(kind)++]);
  }
}

/// Skips METADATA, which ends with an empty line.
void skip_metadata(TextReader& reader) {
  reader.rest_of_line();
  while (!reader.rest_of_line().empty()) {
  }
}

std::string in_small_letters(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

bool is_whole(const std::string& type) {
  static const std::set<std::string> types = {
      "bit",          "char",          "short",     "int",         "long", "unsigned_char", "unsigned_short",
      "unsigned_int", "unsigned_long", "vtkidtype", "vtktypeint64"};
  return types.contains(in_small_letters(type));
}

/// True if other programs give this name to the array of regions.
bool is_of_regions(const std::string& name) {
  static const std::set<std::string> names = {
      "region",    "regions",       "regionid",      "region_id",   "material",
      "materials", "materialid",    "material_id",   "materialids", "matid",
      "mat",       "tag",           "tags",          "cell_tags",   "label",
      "labels",    "part",          "partid",        "subdomain",   "attribute",
      "physical",  "gmsh:physical", "cellentityids", "medit:ref",   "elementblockids"};
  return names.contains(in_small_letters(name));
}

/// Reads an array of one whole number per tuple into `arrays`; skips others.
void read_values(TextReader& reader, const std::string& name, const std::string& type,
                 std::int64_t components, std::int64_t tuples, std::vector<CellArray>* arrays) {
  if (arrays == nullptr || components != 1 || (!is_whole(type) && !is_of_regions(name))) {
    for (std::int64_t i = 0; i < components * tuples && !reader.at_end(); ++i) reader.word("a value");
    return;
  }
  constexpr double most = std::numeric_limits<Index>::max();
  CellArray array{name, {}};
  for (std::int64_t i = 0; i < tuples; ++i) {
    const double value = reader.number("a value");
    if (value == std::round(value) && std::abs(value) <= most)
      array.values.push_back(static_cast<Index>(value));
  }
  if (std::ssize(array.values) == tuples) arrays->push_back(std::move(array));
}

/// Reads arrays of the whole file (time, cycle), of points or of cells.
void read_field(TextReader& reader, std::vector<CellArray>* arrays) {
  reader.word("the field's name");
  const std::int64_t count = reader.count("the number of arrays", 1);
  for (std::int64_t i = 0; i < count; ++i) {
    if (reader.peek() == "METADATA") skip_metadata(reader);
    const std::string name(reader.word("an array's name"));
    const std::int64_t components = reader.count("the number of components", 1);
    const std::int64_t tuples = reader.count("the number of tuples", components);
    const std::string type(reader.word("an array's type"));
    read_values(reader, name, type, components, tuples, arrays);
  }
}

/// Reads an attribute of `tuples` points or cells; false, after its name, for an unknown one.
bool read_attribute(TextReader& reader, const std::string& keyword, std::int64_t tuples,
                    std::vector<CellArray>* arrays) {
  static const std::map<std::string, std::int64_t> components = {{"VECTORS", 3},    {"NORMALS", 3},
                                                                 {"TENSORS", 9},    {"TENSORS6", 6},
                                                                 {"GLOBAL_IDS", 1}, {"PEDIGREE_IDS", 1}};
  if (keyword == "METADATA") {
    skip_metadata(reader);
    return true;
  }
  if (keyword == "FIELD") {
    read_field(reader, arrays);
    return true;
  }
  const std::string name(reader.word("an array's name"));
  if (keyword == "LOOKUP_TABLE") {
    reader.skip_words(4 * reader.count("the size of the table", 4), "a colour");
  } else if (keyword == "SCALARS") {
    const std::string type(reader.word("an array's type"));
    std::int64_t width = 1;
    if (reader.words_on_line() == 1) width = reader.integer("their number", 1, 4);
    if (reader.peek() == "LOOKUP_TABLE") reader.skip_words(2, "the table's name");
    read_values(reader, name, type, width, tuples, arrays);
  } else if (const auto known = components.find(keyword); known != components.end()) {
    reader.word("an array's type");
    reader.skip_words(known->second * tuples, "a value");
  } else {
    return false;
  }
  return true;
}

/// Sets the regions by the array with a name that other programs use, else by the only array.
void take_regions(std::vector<CellArray> arrays, const Cells& cells, MeshFile& mesh) {
  std::erase_if(arrays, [&](const CellArray& array) { return array.values.size() != cells.tags.size(); });
  if (arrays.empty()) return;
  auto regions =
      std::ranges::find_if(arrays, [](const CellArray& array) { return is_of_regions(array.name); });
  if (regions == arrays.end() && arrays.size() > 1) {
    mesh.hint =
        "the file's CELL_DATA has several arrays of whole numbers: call the one of the regions 'region'";
    return;
  }
  if (regions == arrays.end()) regions = arrays.begin();
  for (std::size_t cell = 0; cell < cells.tags.size(); ++cell)
    if (cells.tags[cell] != nullptr) *cells.tags[cell] = regions->values[cell];
}

/// Content of a file, as far as it has been read.
struct Parts {
  MeshFile mesh;
  std::optional<Cells> cells;
  std::vector<CellArray> arrays;
  std::optional<std::int64_t> points, of_cells;  // whose data follow
};

/// Reads the part of the file that a keyword begins. False: no mesh can follow.
bool read_part(TextReader& reader, const std::string& keyword, Parts& read) {
  if (keyword == "POINTS") {
    // The cells were checked against the first list.
    if (!read.mesh.nodes.empty()) reader.fail("POINTS stands twice in the file");
    read.mesh.nodes = read_points(reader);
  } else if (keyword == "CELLS") {
    read.cells = read_cells(reader, read.mesh.nodes.size());
  } else if (keyword == "CELL_TYPES") {
    if (!read.cells) reader.fail("CELL_TYPES stands before CELLS");
    read_types(reader, *read.cells, read.mesh);
  } else if (keyword == "CELL_DATA" && read.cells) {
    const auto cells = std::ssize(read.cells->offsets) - 1;
    read.of_cells = reader.integer("the number of cells", cells, cells);
  } else if (keyword == "POINT_DATA") {
    const auto nodes = std::ssize(read.mesh.nodes);
    read.points = reader.integer("the number of points", nodes, nodes);
    read.of_cells.reset();
  } else if (read.of_cells) {
    return read_attribute(reader, keyword, *read.of_cells, &read.arrays);
  } else if (read.points) {
    return read_attribute(reader, keyword, *read.points, nullptr);
  } else if (keyword == "FIELD") {
    read_field(reader, nullptr);
  } else if (keyword == "METADATA") {
    skip_metadata(reader);
  } else {
    reader.fail_on(keyword, "POINTS, CELLS or CELL_TYPES");
  }
  return true;
}

}  // namespace

std::pair<Mesh, MeshGroups> read_vtk_legacy(const std::filesystem::path& file) {
  TextReader reader(file);
  read_header(reader);
  reader.expect("DATASET");
  if (const std::string kind(reader.word("UNSTRUCTURED_GRID")); kind != "UNSTRUCTURED_GRID") {
    reader.fail(fmt::format("the file holds a {:.40}, not an UNSTRUCTURED_GRID", kind),
                "Save the volume mesh as unstructured grid");
  }
  Parts read;
  while (!reader.at_end() && read_part(reader, std::string(reader.word("a keyword")), read)) {
  }
  if (read.cells) take_regions(std::move(read.arrays), *read.cells, read.mesh);
  return to_body(std::move(read.mesh), reader);
}

}  // namespace palpate
