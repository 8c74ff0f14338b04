// Pages of what models and recordings hold.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <type_traits>

#include "base/error.h"
#include "docs/describe/field_meanings.h"
#include "docs/describe/header_members.h"
#include "docs/describe/markdown.h"
#include "docs/describe/pages.h"
#include "formats/dynamics_fields.h"
#include "formats/hierarchical_fields.h"
#include "formats/model_file.h"
#include "formats/precision_fields.h"
#include "runtime/exports/session_hdf5.h"

namespace palpate {
namespace {

using Rows = std::vector<std::vector<std::string>>;

template <class T>
std::string type_name() {
  if constexpr (std::is_floating_point_v<T>) return fmt::format("float{}", 8 * sizeof(T));
  return fmt::format("{}int{}", std::is_unsigned_v<T> ? "u" : "", 8 * sizeof(T));
}

/// A dataset as the bodies of each kind of element have it.
struct Dataset {
  std::string path;
  std::string type;
  std::map<ElementType, std::vector<Extent>> shapes{};
};

/// Every dataset of the tables, in the order of the file.
class Datasets {
 public:
  void read(ElementType element) {
    Model model;
    model.mesh.element = element;
    const auto take = [&]<class T>(const Field<T>& field) { add<T>(element, field.path, field.shape); };
    for_each_body_field(element, take);
    for_each_overlay_field(take);
    for_each_warp_field(take);
    visit_greens_errors(take);
    for (const DynamicsMethod method : {DynamicsMethod::packed, DynamicsMethod::modal}) {
      model.dynamics.method = method;
      for_each_dynamics_field(model, take);
      for_each_smooth_field(model, take);
    }
    visit_inverse_errors(take);
    for_each_tree_field(take);
    for_each_rank_field(take);
    for_each_probe_field(element, take);
  }

  [[nodiscard]] const std::vector<Dataset>& all() const { return all_; }

 private:
  template <class T>
  void add(ElementType element, const std::string& path, const std::vector<Extent>& shape) {
    auto found = std::ranges::find(all_, path, &Dataset::path);
    if (found == all_.end()) found = all_.insert(all_.end(), {path, type_name<T>()});
    found->shapes[element] = shape;
  }

  std::vector<Dataset> all_;
};

std::string symbol_of(Count count) {
  switch (count) {
    case Count::one:
      return "";
    case Count::nodes:
      return "N";
    case Count::elements:
      return "E";
    case Count::simplices:
      return "F";
    case Count::materials:
      return "M";
    case Count::stored_nodes:
      return "S";
    case Count::probes:
      return "P";
    case Count::bytes_of_text:
    case Count::bytes_of_sources:
      return "length";
    case Count::patches:
      return "O";
    case Count::patch_surface_nodes:
      return "sum of q";
    case Count::patch_softening_entries:
      return "sum of d g (d g + 1) / 2";
    case Count::patch_transfer_entries:
      return "sum of d q d g";
    case Count::patch_compliance_entries:
      return "sum of d q (d q + 1) / 2";
    case Count::matrix_entries:
      return "e";
    case Count::modes:
      return "m";
    case Count::smooth_terms:
      return "w";
    case Count::near_pairs:
      return "a";
    case Count::far_pairs:
      return "b";
    case Count::clusters:
      return "c";
    case Count::certified:
      return "t";
    case Count::warp_nodes:
      return "p";
    case Count::warp_levels:
      return "l";
  }
  return "";
}

/// The factor of an extent, which may differ with the element: "", "3", "d" or "k".
std::string factor_of(const Dataset& dataset, std::size_t dim) {
  const auto is = [&](auto&& number) {
    return std::ranges::all_of(dataset.shapes, [&](const auto& shape) {
      return shape.second[dim].factor == number(traits(shape.first));
    });
  };
  const std::int64_t first = dataset.shapes.begin()->second[dim].factor;
  if (is([&](const ElementTraits&) { return first; })) return first == 1 ? "" : std::to_string(first);
  if (is([](const ElementTraits& kind) { return kind.dimension; })) return "d";
  if (is([](const ElementTraits& kind) { return kind.nodes; })) return "k";
  throw Error("has a shape that differs with the element in an unknown way", dataset.path,
              "name it in factor_of");
}

/// "*N*", "3", "*E* + 1", "*n*".
std::string extent_text(const Dataset& dataset, std::size_t dim) {
  const Extent extent = dataset.shapes.begin()->second[dim];
  const std::string factor = factor_of(dataset, dim);
  std::string text = symbol_of(extent.count);
  if (extent.count == Count::stored_nodes && factor == "d") {
    text = "n";
  } else if (!factor.empty()) {
    text = text.empty() ? factor : factor + " " + text;
  }
  if (text.empty()) text = "1";
  if (std::isalpha(static_cast<unsigned char>(text[0])) != 0) text = "*" + text + "*";
  if (extent.plus != 0) text += fmt::format(" + {}", extent.plus);
  return text;
}

std::string shape_text(const Dataset& dataset) {
  std::string text;
  for (std::size_t dim = 0; dim < dataset.shapes.begin()->second.size(); ++dim)
    text += (text.empty() ? "" : ", ") + extent_text(dataset, dim);
  return text;
}

/// What is said of a path; throws Error where nothing is.
std::string meaning_of(std::span<const FieldMeaning> meanings, const std::string& path) {
  const auto found = std::ranges::find(meanings, path, &FieldMeaning::path);
  if (found == meanings.end())
    throw Error("is in the file and not in the reference", path, "add it to field_meanings.cpp");
  return std::string(found->meaning);
}

/// Throws Error where something is said of what is not there.
void expect_all(std::span<const FieldMeaning> meanings, const Rows& rows) {
  for (const FieldMeaning& field : meanings) {
    const std::string first = code(std::string(field.path));
    if (std::ranges::none_of(rows, [&](const auto& row) { return row[0] == first; }))
      throw Error("is in the reference and not in the file", std::string(field.path),
                  "take it out of field_meanings.cpp");
  }
}

std::string attribute_table() {
  Rows rows;
  const auto add = [&](const std::string& name) {
    rows.push_back({code(name), meaning_of(model_attribute_meanings(), name)});
  };
  add("format");
  add("version");
  for_each_attribute([&](const auto& attribute) { add(attribute.name); });
  add("content_hash");
  expect_all(model_attribute_meanings(), rows);
  return markdown_table({"root attribute", "value"}, rows);
}

Rows dataset_rows() {
  Datasets datasets;
  for (const ElementType element : body_elements) datasets.read(element);
  Rows rows;
  for (const Dataset& dataset : datasets.all())
    rows.push_back({code(dataset.path), dataset.type, shape_text(dataset),
                    meaning_of(model_field_meanings(), dataset.path)});
  for (const std::string path : {greens_path, inverse_path})  // mapped and not copied: in no table
    rows.push_back(
        {code(path), "float32 or float64", "*n* (*n* + 1) / 2", meaning_of(model_field_meanings(), path)});
  for (const CompressedArray& array : compressed_arrays)  // mapped and not copied, too
    rows.push_back({code(array.path), "float32", "*length*", meaning_of(model_field_meanings(), array.path)});
  expect_all(model_field_meanings(), rows);
  return rows;
}

/// The rows of a group, "/mesh" for instance.
std::string group_table(const Rows& rows, const std::vector<std::string>& groups) {
  Rows chosen;
  for (const auto& row : rows)
    if (std::ranges::any_of(groups,
                            [&](const std::string& group) { return row[0].starts_with("`" + group); }))
      chosen.push_back(row);
  return markdown_table({"dataset", "type", "shape", "what"}, chosen);
}

/// A dataset of ticks by the member that it holds.
Rows tick_rows() {
  const std::vector<Declaration> header = declarations_of("formats/recording.h");
  const std::vector<Member>& members = declaration(header, "TickRecord").members;
  Rows rows;
  for (const TickColumn& column : tick_columns()) {
    const auto member = std::ranges::find(members, column.name, &Member::name);
    if (member == members.end() || member->comment.empty())
      throw Error("has no doc comment", "TickRecord::" + column.name, "add it to formats/recording.h");
    rows.push_back({code("/ticks/" + column.name), column.type.name,
                    column.components == 1 ? "*T*" : fmt::format("*T*, {}", column.components),
                    member->comment});
  }
  return rows;
}

constexpr const char* model_letters =
    "*N* nodes, *E* elements of *k* nodes, *d* dimensions, *F* surface simplices, *M* materials, *S* stored "
    "nodes, *n* = *d S* stored dofs, *P* probes, *O* overlays of *g* nodes and *q* surface nodes, *m* modes, "
    "*e* entries of the mass matrix, *w* smooth terms, *a* near and *b* far pairs of *c* clusters, *t* kinds "
    "of touches, *p* loaded nodes and *l* levels of a study of warping. Nodes and vectors have three "
    "components in the plane "
    "too; the third is 0 there.";

}  // namespace

Page file_fields_page() {
  const Rows rows = dataset_rows();
  std::string text = fmt::format(
      "# Fields of NAME.palpate.hdf\n\n"
      "All attributes and datasets of a baked model, format version {}.{}. Values are little-endian and in "
      "SI "
      "units. How the file is laid out, checked and read: [file format](../file-format.md).\n\n"
      "{}\n\n## Attributes\n\n",
      format_major, format_minor, model_letters);
  text += attribute_table();
  text += "## Mesh and held nodes\n\n" + group_table(rows, {"/mesh", "/dofs"});
  text += "## Materials and rest state\n\n" + group_table(rows, {"/material", "/rest"});
  text += "## Green's functions\n\n" + group_table(rows, {"/greens"});
  text +=
      "## Overlays\n\nFiles without overlays do not have this group.\n\n" + group_table(rows, {"/overlay"});
  text += "## Study of warping\n\nFiles without `[warp]`, and those before 3.6, do not have this group.\n\n" +
          group_table(rows, {"/warp"});
  text += "## Dynamics\n\nFiles without `[dynamics]` do not have this group.\n\n" +
          group_table(rows, {"/dynamics"});
  text += "## Probes, quality and origin\n\n" +
          group_table(rows, {"/probes", "/quality", "/model_toml", "/provenance", "/VTKHDF"});
  return {"file-fields", text};
}

Page recording_fields_page() {
  Rows attributes;
  for (const FieldMeaning& attribute : recording_attribute_meanings())
    attributes.push_back({code(std::string(attribute.path)), std::string(attribute.meaning)});
  Rows surface = {
      {"`/surface/nodes`", "float64", "*S*, 3", "the surface without loads [m]"},
      {"`/surface/simplices`", "int32", "*F*, *d*", "its triangles; lines in the plane"},
      {"`/surface/held`", "uint8", "*S*", "bit 0, 1, 2 is set where the node is held along x, y, z"},
      {"`/frames/tick`", "int64", "*R*", "the tick that a picture shows"},
      {"`/frames/time`", "float64", "*R*", "when that was, since the start [s]"},
      {"`/frames/displacement`", "float32", "*R*, *S*, 3", "u0 + u: node + displacement is what is seen [m]"},
      {"`/frames/von_mises`", "float32", "*R*, *S*",
       "von Mises stress [Pa]; not a number where it is not known"},
      {"`/frames/pressure`", "float32", "*R*, *S*",
       "contact pressure [Pa], positive where the tool presses, negative where a grab pulls"}};
  std::string text =
      "# Fields of a recording\n\n"
      "All fields of a recording, by the names that `palpate.read` gives them (without `/ticks/`) and that "
      "datasets have after `palpate-runtime export SESSION.mcap --hdf5 OUT.h5`. *T* ticks, *R* pictures, *S* "
      "surface nodes, *F* surface simplices of *d* nodes. Guide: [recordings](../recordings.md). How the "
      "recording itself lies on disk: [format](../recording-format.md). Bits and numbers of `status`, "
      "`fault` "
      "and `phase`: [status bits](status-bits.md).\n\n## Attributes\n\n";
  text += markdown_table({"root attribute", "value"}, attributes);
  text +=
      "## Ticks\n\nOne row per tick.\n\n" + markdown_table({"dataset", "type", "shape", "what"}, tick_rows());
  text += "## Surface and pictures\n\nPictures are taken at display rate (`--record-frames`).\n\n" +
          markdown_table({"dataset", "type", "shape", "what"}, surface);
  return {"recording-fields", text};
}

}  // namespace palpate
