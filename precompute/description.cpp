#include "precompute/description.h"

#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <limits>
#include <numeric>
#include <string_view>

#include "meshes/error.h"

namespace palpate {
namespace {

using Keys = std::vector<std::string_view>;

const Keys geometry_kinds = {"surface", "image", "volume", "box", "cylinder", "sphere"};
const Keys fixed_kinds = {"box", "half_space", "sphere", "nodes", "tag", "lowest"};

std::string comma_list(const Keys& keys) {
  std::string text;
  for (const std::string_view key : keys) {
    text += (text.empty() ? "" : ", ") + std::string(key);
  }
  return text;
}

/// Levenshtein distance.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

std::string_view nearest(std::string_view key, const Keys& known) {
  return *std::min_element(known.begin(), known.end(), [&](std::string_view a, std::string_view b) {
    return edit_distance(key, a) < edit_distance(key, b);
  });
}

/// One table of model.toml: its values by key, every failure with its line and column. The title of the whole
/// file is "".
class Section {
 public:
  /// Throws Error when the table holds a key that is not in `known`.
  Section(const toml::table& table, std::string title, const std::string& file, const Keys& known)
      : table_(table), title_(std::move(title)), file_(file) {
    for (const auto& [key, value] : table_) {
      if (std::find(known.begin(), known.end(), key.str()) == known.end()) {
        throw Error(
            "unknown key \"" + std::string(key.str()) + "\"" + (title_.empty() ? "" : " in " + title_),
            place(key.source()),
            "the nearest known key is \"" + std::string(nearest(key.str(), known)) + "\" of " +
                comma_list(known));
      }
    }
  }

  [[nodiscard]] bool has(std::string_view key) const { return table_.contains(key); }

  /// The one key of `kinds` that is present.
  [[nodiscard]] std::string_view only_one_of(const Keys& kinds) const {
    std::string_view found;
    for (const std::string_view kind : kinds) {
      if (!has(kind)) {
        continue;
      }
      if (!found.empty()) {
        fail(kind, title_ + " has both " + std::string(found) + " and " + std::string(kind),
             "keep one of them");
      }
      found = kind;
    }
    if (found.empty()) {
      fail("", title_ + " says nothing", "give one of " + comma_list(kinds));
    }
    return found;
  }

  [[nodiscard]] double number(std::string_view key) const { return as_number(required(key), key); }

  [[nodiscard]] double number(std::string_view key, double fallback) const {
    return has(key) ? number(key) : fallback;
  }

  [[nodiscard]] double positive(std::string_view key) const {
    const double value = number(key);
    if (!(value > 0.0)) {
      fail(key, name_of(key) + " must be greater than 0, not " + shown(value), "give a positive number");
    }
    return value;
  }

  [[nodiscard]] double positive(std::string_view key, double fallback) const {
    return has(key) ? positive(key) : fallback;
  }

  [[nodiscard]] double within(std::string_view key, double low, double high, double fallback) const {
    const double value = number(key, fallback);
    if (value < low || value > high) {
      fail(key, name_of(key) + " must be from " + shown(low) + " to " + shown(high) + ", not " + shown(value),
           "choose a value in that range");
    }
    return value;
  }

  [[nodiscard]] Index integer(std::string_view key) const { return as_integer(required(key), key); }

  [[nodiscard]] int count(std::string_view key) const {
    const Index value = integer(key);
    check_count(value, key);
    return value;
  }

  [[nodiscard]] bool boolean(std::string_view key, bool fallback) const {
    if (!has(key)) {
      return fallback;
    }
    const auto value = required(key).value_exact<bool>();
    if (!value) {
      wrong_type(key, "true or false");
    }
    return *value;
  }

  [[nodiscard]] std::string text(std::string_view key) const {
    const auto value = required(key).value_exact<std::string>();
    if (!value) {
      wrong_type(key, "a text in quotes");
    }
    return *value;
  }

  [[nodiscard]] Vec3 vector(std::string_view key) const {
    const toml::array& values = array(key, "three numbers", 3);
    return {as_number(values[0], key), as_number(values[1], key), as_number(values[2], key)};
  }

  [[nodiscard]] Vec3 vector(std::string_view key, const Vec3& fallback) const {
    return has(key) ? vector(key) : fallback;
  }

  [[nodiscard]] Vec3 positive_vector(std::string_view key) const {
    Vec3 value = vector(key);
    if (!(value.minCoeff() > 0.0)) {
      fail(key, name_of(key) + " must be greater than 0 in each direction", "give three positive numbers");
    }
    return value;
  }

  [[nodiscard]] std::array<int, 3> counts(std::string_view key) const {
    const toml::array& values = array(key, "three whole numbers", 3);
    std::array<int, 3> result{};
    for (std::size_t i = 0; i < 3; ++i) {
      result[i] = as_integer(values[i], key);
      check_count(result[i], key);
    }
    return result;
  }

  /// A list of at least one whole number.
  [[nodiscard]] std::vector<Index> integers(std::string_view key) const {
    const toml::array& values = array(key, "a list of whole numbers", 0);
    std::vector<Index> result;
    for (const toml::node& value : values) {
      result.push_back(as_integer(value, key));
    }
    if (result.empty()) {
      fail(key, name_of(key) + " is empty", "list at least one number");
    }
    return result;
  }

  [[nodiscard]] Section section(std::string_view key, const Keys& known) const {
    const toml::node& node = required(key);
    if (!node.is_table()) {
      wrong_type(key, "a table {" + comma_list(known) + "}");
    }
    return Section(*node.as_table(), title_.empty() ? std::string("[").append(key).append("]") : name_of(key),
                   file_, known);
  }

  /// `key` is the value to point at; the table itself where it is empty or absent.
  [[noreturn]] void fail(std::string_view key, const std::string& what, const std::string& hint) const {
    const toml::node* node = table_.get(key);
    throw Error(what, place(node != nullptr ? node->source() : table_.source()), hint);
  }

  [[nodiscard]] std::string name_of(std::string_view key) const {
    return (title_.empty() ? "" : title_ + " ") + std::string(key);
  }

  [[nodiscard]] const toml::node& required(std::string_view key) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) {
      fail(key, name_of(key) + " is missing",
           title_.empty() ? "add it at the top level" : "add it to " + title_);
    }
    return *node;
  }

  static std::string shown(double value) {
    std::array<char, 32> text{};
    const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
    return {text.data(), end};
  }

 private:
  [[nodiscard]] std::string place(const toml::source_region& source) const {
    const toml::source_position at = source.begin;
    return at.line == 0 ? file_ : file_ + ":" + std::to_string(at.line) + ":" + std::to_string(at.column);
  }

  [[noreturn]] void wrong_type(std::string_view key, const std::string& expected) const {
    fail(key, name_of(key) + " must be " + expected, "write " + std::string(key) + " = " + expected);
  }

  [[nodiscard]] double as_number(const toml::node& node, std::string_view key) const {
    const auto value = node.value<double>();
    if (!value || !node.is_number()) {
      wrong_type(key, "a number");
    }
    if (!std::isfinite(*value)) {
      fail(key, name_of(key) + " is not a finite number", "replace nan or inf by a number");
    }
    return *value;
  }

  [[nodiscard]] Index as_integer(const toml::node& node, std::string_view key) const {
    const auto value = node.value_exact<std::int64_t>();
    if (!value) {
      wrong_type(key, "a whole number");
    }
    if (*value < std::numeric_limits<Index>::min() || *value > std::numeric_limits<Index>::max()) {
      fail(key, name_of(key) + " is out of range: " + std::to_string(*value),
           "node and tag numbers have 32 bits");
    }
    return static_cast<Index>(*value);
  }

  void check_count(Index value, std::string_view key) const {
    if (value < 1) {
      fail(key, name_of(key) + " must be at least 1, not " + std::to_string(value),
           "give a positive whole number");
    }
  }

  /// `size` 0 is any size.
  [[nodiscard]] const toml::array& array(std::string_view key, const std::string& expected,
                                         std::size_t size) const {
    const toml::array* values = required(key).as_array();
    if (values == nullptr || (size != 0 && values->size() != size)) {
      wrong_type(key, "[" + expected + "]");
    }
    return *values;
  }

  const toml::table& table_;
  std::string title_;
  const std::string& file_;
};

/// Six tetrahedra a cell must stay within the 32-bit element numbers.
void check_cells(const Section& shape, std::string_view key, double cells) {
  if (6.0 * cells > std::numeric_limits<Index>::max()) {
    shape.fail(key, shape.name_of(key) + " asks for too many cells: " + Section::shown(cells),
               "at most 357913941 cells can be numbered");
  }
}

BoxShape read_box_shape(const Section& box) {
  BoxShape shape{box.vector("origin", Vec3::Zero()), box.positive_vector("size"), box.counts("cells")};
  check_cells(box, "cells", double{1} * shape.cells[0] * shape.cells[1] * shape.cells[2]);
  return shape;
}

int read_cells_across(const Section& shape) {
  const int cells = shape.count("cells_across");
  if (cells % 2 != 0) {
    shape.fail("cells_across", shape.name_of("cells_across") + " must be even, not " + std::to_string(cells),
               "use " + std::to_string(cells + 1));
  }
  return cells;
}

CylinderShape read_cylinder(const Section& cylinder) {
  const CylinderShape shape{cylinder.positive("radius"), cylinder.positive("height"),
                            read_cells_across(cylinder), cylinder.count("cells_along")};
  check_cells(cylinder, "cells_across",
              double{1} * shape.cells_across * shape.cells_across * shape.cells_along);
  return shape;
}

SphereShape read_sphere(const Section& sphere) {
  const SphereShape shape{sphere.positive("radius"), read_cells_across(sphere)};
  check_cells(sphere, "cells_across", std::pow(shape.cells_across, 3));
  return shape;
}

Geometry read_geometry(const Section& geometry, const std::filesystem::path& folder) {
  const std::string_view kind = geometry.only_one_of(geometry_kinds);
  const auto file = [&] { return (folder / geometry.text(kind)).lexically_normal(); };
  if (kind != "image" && geometry.has("labels")) {
    geometry.fail("labels", "[geometry] labels apply to images only, this geometry is a " + std::string(kind),
                  "remove labels");
  }
  if (kind == "surface") {
    return SurfaceGeometry{file()};
  }
  if (kind == "image") {
    ImageGeometry image{file(), {}};
    if (geometry.has("labels")) {
      image.labels = geometry.integers("labels");
    }
    return image;
  }
  if (kind == "volume") {
    return VolumeGeometry{file()};
  }
  if (kind == "box") {
    return read_box_shape(geometry.section(kind, {"origin", "size", "cells"}));
  }
  if (kind == "cylinder") {
    return read_cylinder(geometry.section(kind, {"radius", "height", "cells_across", "cells_along"}));
  }
  return read_sphere(geometry.section(kind, {"radius", "cells_across"}));
}

const Keys mesh_keys = {"mesher",      "edge_length",  "remesh",        "grading",
                        "radius_edge", "min_dihedral", "facet_distance"};

/// The keys of [mesh] that mean something for a kind of geometry, and its mesher.
struct MesherChoice {
  Keys keys;
  std::string mesher;
};

MesherChoice mesher_for(std::string_view kind) {
  if (kind == "surface") {
    return {{"mesher", "edge_length", "remesh", "grading", "radius_edge", "min_dihedral"}, "tetgen"};
  }
  if (kind == "image") {
    return {{"mesher", "edge_length", "grading", "radius_edge", "facet_distance"}, "cgal"};
  }
  return {};
}

void check_mesh_keys(const Section& mesh, std::string_view kind) {
  const MesherChoice choice = mesher_for(kind);
  for (const std::string_view key : mesh_keys) {
    if (mesh.has(key) && std::find(choice.keys.begin(), choice.keys.end(), key) == choice.keys.end()) {
      mesh.fail(key,
                "[mesh] " + std::string(key) + " does not apply to geometry of kind " + std::string(kind),
                choice.keys.empty() ? "a " + std::string(kind) + " is a mesh already: remove [mesh]"
                                    : "remove it; what applies is " + comma_list(choice.keys));
    }
  }
  if (mesh.has("mesher") && mesh.text("mesher") != choice.mesher) {
    mesh.fail("mesher",
              "mesher \"" + mesh.text("mesher") + "\" cannot mesh geometry of kind " + std::string(kind),
              "use mesher = \"" + choice.mesher + "\", or remove the line");
  }
  const bool needs_edge_length = kind == "image" || mesh.boolean("remesh", false);
  if (needs_edge_length && !mesh.has("edge_length")) {
    mesh.fail("remesh", "[mesh] has no edge_length", "give the edge length wanted at the surface, in metres");
  }
}

MeshOptions read_mesh_options(const Section& mesh, std::string_view kind) {
  check_mesh_keys(mesh, kind);
  MeshOptions options;
  if (mesh.has("edge_length")) {
    options.edge_length = mesh.positive("edge_length");
  }
  if (mesh.has("facet_distance")) {
    options.facet_distance = mesh.positive("facet_distance");
  }
  options.remesh = mesh.boolean("remesh", options.remesh);
  options.grading = mesh.within("grading", 0.0, 10.0, options.grading);
  options.radius_edge = mesh.within("radius_edge", 1.0, 100.0, options.radius_edge);
  options.min_dihedral = mesh.within("min_dihedral", 0.0, 20.0, options.min_dihedral);
  return options;
}

Material read_material(const Section& material) {
  Material result;
  result.youngs_modulus = material.positive("youngs_modulus");
  result.poissons_ratio = material.number("poissons_ratio");
  result.density = material.positive("density", result.density);
  if (!(result.poissons_ratio > -1.0 && result.poissons_ratio < 0.5)) {
    material.fail("poissons_ratio",
                  "[material] poissons_ratio must lie between -1 and 1/2, both excluded, not " +
                      Section::shown(result.poissons_ratio),
                  "nearly incompressible tissue is 0.45 to 0.49");
  }
  return result;
}

SelectBox read_select_box(const Section& box) {
  SelectBox result{box.vector("min"), box.vector("max")};
  if ((result.min.array() > result.max.array()).any()) {
    box.fail("min", box.name_of("min") + " is greater than max", "exchange them where min > max");
  }
  return result;
}

SelectHalfSpace read_half_space(const Section& half_space) {
  SelectHalfSpace result{half_space.vector("point"), half_space.vector("normal")};
  if (result.normal.isZero(0.0)) {
    half_space.fail("normal", half_space.name_of("normal") + " is the zero vector",
                    "the half space is where (x - point) . normal >= 0");
  }
  return result;
}

SelectLowest read_lowest(const Section& lowest) {
  const std::string axis = lowest.text("axis");
  if (axis != "x" && axis != "y" && axis != "z") {
    lowest.fail("axis", lowest.name_of("axis") + " is \"" + axis + "\"", "use \"x\", \"y\" or \"z\"");
  }
  const double percent = lowest.positive("percent");
  if (percent > 100.0) {
    lowest.fail("percent", lowest.name_of("percent") + " is " + Section::shown(percent), "use at most 100");
  }
  return {axis[0] - 'x', percent / 100.0};
}

Selection read_selection(const Section& fixed) {
  const std::string_view kind = fixed.only_one_of(fixed_kinds);
  if (kind == "box") {
    return read_select_box(fixed.section(kind, {"min", "max"}));
  }
  if (kind == "half_space") {
    return read_half_space(fixed.section(kind, {"point", "normal"}));
  }
  if (kind == "sphere") {
    const Section sphere = fixed.section(kind, {"center", "radius"});
    return SelectSphere{sphere.vector("center"), sphere.positive("radius")};
  }
  if (kind == "nodes") {
    return SelectNodes{fixed.integers(kind)};
  }
  if (kind == "tag") {
    return SelectTag{fixed.integer(kind)};
  }
  return read_lowest(fixed.section(kind, {"axis", "percent"}));
}

std::vector<Selection> read_fixed(const Section& root, const std::string& file) {
  const std::string hint = "add for example\n[[fixed]]\nlowest = {axis = \"z\", percent = 5}";
  if (!root.has("fixed")) {
    root.fail("fixed", "no region is fixed: the body would fly away at the first touch", hint);
  }
  const toml::array* entries = root.required("fixed").as_array();
  if (entries == nullptr || entries->empty()) {
    root.fail("fixed", "fixed must be a list of at least one region", hint);
  }
  std::vector<Selection> result;
  for (const toml::node& entry : *entries) {
    if (!entry.is_table()) {
      root.fail("fixed", "every fixed region must be a table", hint);
    }
    result.push_back(read_selection(Section(*entry.as_table(), "[[fixed]]", file, fixed_kinds)));
  }
  return result;
}

Scope read_scope(const Section& storage) {
  const std::string scope = storage.has("scope") ? storage.text("scope") : "layers";
  if (scope == "surface") {
    return Scope::surface;
  }
  if (scope == "layers") {
    return Scope::layers;
  }
  if (scope != "full") {
    storage.fail("scope", "[storage] scope is \"" + scope + "\"", R"(use "surface", "layers" or "full")");
  }
  return Scope::full;
}

Index read_layers(const Section& storage, Scope scope) {
  if (scope == Scope::layers) {
    return storage.has("layers") ? storage.count("layers") : 1;
  }
  if (storage.has("layers")) {
    storage.fail("layers", "[storage] layers applies to scope \"layers\" only",
                 "remove layers, or set scope = \"layers\"");
  }
  return 0;
}

Precision read_precision(const Section& storage) {
  const std::string precision = storage.has("precision") ? storage.text("precision") : "single";
  if (precision != "single" && precision != "double") {
    storage.fail("precision", "[storage] precision is \"" + precision + "\"", R"(use "single" or "double")");
  }
  return precision == "single" ? Precision::single_precision : Precision::double_precision;
}

/// The name becomes a file name.
std::string read_name(const Section& root) {
  std::string name = root.text("name");
  const bool printable =
      std::all_of(name.begin(), name.end(), [](unsigned char c) { return c > 31 && c != '/'; });
  if (name.empty() || name[0] == '.' || !printable) {
    root.fail("name", "name \"" + name + "\" cannot be the name of a file",
              "use letters, digits, - and _; the baked file is called NAME.palpate.hdf");
  }
  return name;
}

std::string read_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in || std::filesystem::is_directory(file)) {
    throw Error("cannot read the model description", file.string(), "give the path of a model.toml");
  }
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

toml::table parse(const std::string& text, const std::string& file) {
  try {
    return toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    const toml::source_position at = error.source().begin;
    throw Error("not valid TOML: " + std::string(error.description()),
                file + ":" + std::to_string(at.line) + ":" + std::to_string(at.column),
                "see https://toml.io for the syntax");
  }
}

}  // namespace

Description read_description(const std::filesystem::path& path) {
  const std::string file = path.string();
  Description result;
  result.file = path;
  result.text = read_text(path);
  const toml::table table = parse(result.text, file);
  const toml::table empty;
  const Section root(table, "", file, {"name", "geometry", "mesh", "material", "fixed", "storage"});

  Keys geometry_keys = geometry_kinds;
  geometry_keys.insert(geometry_keys.end(), {"labels", "scale"});
  const Section geometry = root.section("geometry", geometry_keys);
  const Keys storage_keys = {"scope", "layers", "precision"};
  const Section mesh =
      root.has("mesh") ? root.section("mesh", mesh_keys) : Section(empty, "[mesh]", file, mesh_keys);
  const Section storage = root.has("storage") ? root.section("storage", storage_keys)
                                              : Section(empty, "[storage]", file, storage_keys);

  result.name = read_name(root);
  result.geometry = read_geometry(geometry, path.parent_path());
  result.scale = geometry.positive("scale", 1.0);
  result.mesh = read_mesh_options(mesh, geometry.only_one_of(geometry_kinds));
  result.material = read_material(root.section("material", {"youngs_modulus", "poissons_ratio", "density"}));
  result.fixed = read_fixed(root, file);
  result.scope = read_scope(storage);
  result.layers = read_layers(storage, result.scope);
  result.precision = read_precision(storage);
  return result;
}

}  // namespace palpate
