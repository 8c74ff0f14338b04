#include "precompute/description/read_description.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "base/regular_file.h"
#include "base/toml_text.h"
#include "base/words.h"
#include "formats/file_kinds.h"
#include "precompute/description/description_keys.h"
#include "precompute/description/description_parts.h"

namespace palpate {
namespace {

const std::string add_plane =
    R"(add plane = "stress" (a thin sheet) or plane = "strain" (a slice of a long body) at the top level)";

Analysis read_analysis(const TomlTable& root, std::string_view kind) {
  if (!root.has("plane")) {
    if (is_plane(kind)) {
      root.fail("plane", "plane is missing: a " + std::string(kind) + " lies in the plane", add_plane);
    }
    return Analysis::solid;
  }
  if (!is_plane(kind) && kind != "volume") {
    root.fail("plane", "plane is given, but geometry of kind " + std::string(kind) + " is in space",
              "remove plane");
  }
  return root.choice("plane", {"stress", "strain"}) == "stress" ? Analysis::plane_stress
                                                                : Analysis::plane_strain;
}

double read_thickness(const TomlTable& root, Analysis analysis) {
  if (analysis == Analysis::solid && root.has("thickness")) {
    root.fail("thickness", "thickness is given, but the body is in space",
              "remove it; a body in the plane also has plane = \"stress\" or \"strain\"");
  }
  return root.positive("thickness", 1.0);
}

/// Reads the scope. In the plane the interior is cheap and visible: without scope and layers, all of it is
/// kept.
Scope read_scope(const TomlTable& storage, int dimension) {
  const std::string usual = dimension == 2 && !storage.has("layers") ? "full" : "layers";
  const std::string scope =
      storage.has("scope") ? storage.choice("scope", {"surface", "layers", "full", "none"}) : usual;
  if (scope == "surface") return Scope::surface;
  if (scope == "none") return Scope::none;
  return scope == "layers" ? Scope::layers : Scope::full;
}

/// Throws Error for settings that need Green's functions.
void check_without_greens(const TomlTable& root, const TomlTable& storage) {
  for (const char* key : {"precision", "compression", "tolerance"}) {
    if (storage.has(key)) {
      storage.fail(key,
                   fmt::format("[storage] {} is about Green's functions, and scope \"none\" keeps none", key),
                   fmt::format("remove {}, or set another scope", key));
    }
  }
  for (const char* key : {"overlay", "dynamics"}) {
    if (root.has(key))
      root.fail(key, fmt::format("[{}] needs Green's functions, and scope \"none\" keeps none", key),
                fmt::format("remove [{}], or set another scope in [storage]", key));
  }
}

constexpr double least_tolerance = 1e-4;  // of compression; below it packed storage is no larger

Index read_layers(const TomlTable& storage, Scope scope) {
  if (scope == Scope::layers) {
    return storage.has("layers") ? storage.count("layers") : 1;
  }
  if (storage.has("layers")) {
    storage.fail("layers", "[storage] layers applies to scope \"layers\" only",
                 "remove layers, or set scope = \"layers\"");
  }
  return 0;
}

/// Reads the precision; nullopt for "auto".
std::optional<Precision> read_precision(const TomlTable& storage) {
  if (!storage.has("precision")) return std::nullopt;
  const std::string name = storage.choice("precision", {"auto", "single", "split", "double"});
  for (const Precision precision :
       {Precision::single_precision, Precision::split_precision, Precision::double_precision})
    if (name == name_of(precision)) return precision;
  return std::nullopt;
}

StorageForm read_form(const TomlTable& storage) {
  if (!storage.has("compression")) return StorageForm::automatic;
  const std::string name = storage.choice("compression", {"auto", "none", "h2"});
  if (name == "none") return StorageForm::packed;
  if (name == "auto") return StorageForm::automatic;
  if (storage.has("precision") &&
      storage.choice("precision", {"auto", "single", "split", "double"}) != "auto")
    storage.fail("precision", "[storage] precision applies to Green's functions that are not compressed",
                 "remove precision, or set compression = \"none\"");
  return StorageForm::compressed;
}

double read_tolerance(const TomlTable& storage, StorageForm form) {
  const double tolerance = storage.positive("tolerance", Description{}.tolerance);
  if (form == StorageForm::packed && storage.has("tolerance"))
    storage.fail("tolerance", "[storage] tolerance applies to compressed Green's functions only",
                 "remove tolerance, or set compression = \"h2\"");
  if (tolerance < least_tolerance || tolerance > 1.0)
    storage.fail("tolerance", "[storage] tolerance must be 1e-4 to 1",
                 "it is the largest relative error that forces may have; compression = \"none\" has none");
  return tolerance;
}

/// Reads the name, which becomes a file name.
std::string read_name(const TomlTable& root) {
  std::string name = root.text("name");
  const bool printable =
      std::all_of(name.begin(), name.end(), [](unsigned char c) { return c > 31 && c != '/'; });
  if (name.empty() || name[0] == '.' || !printable) {
    root.fail("name", "name \"" + shortened(name) + "\" cannot be the name of a file",
              "use letters, digits, - and _; the baked file is called NAME.palpate.hdf");
  }
  return name;
}

/// Keeps the image's labels apart in the mesh if materials need them.
void keep_regions(const TomlTable& table, Geometry& geometry, const std::vector<MaterialPart>& materials) {
  if (auto* image = std::get_if<ImageGeometry>(&geometry)) {
    image->regions = std::any_of(materials.begin(), materials.end(),
                                 [](const MaterialPart& part) { return !part.regions.empty(); });
    if (image->regions && image->range)
      table.fail("range", "[geometry] range makes a single tissue, but a [[material]] has regions",
                 "remove range or regions; tissues of their own need a segmented image");
  }
}

/// Throws Error for mesh = "part.vtk": the file's kind indicates the right key better than the nearest word.
void refuse_files_under_other_keys(const toml::table& table, const TomlTable& root) {
  const toml::table* const geometry = table["geometry"].as_table();
  if (geometry == nullptr) return;
  const Keys known = keys_of("[geometry]");
  for (const auto& [key, value] : *geometry) {
    const auto name = value.value_exact<std::string>();
    if (!name || std::ranges::find(known, key.str()) != known.end()) continue;
    const FileKind* const kind = kind_by_name(*name);
    if (kind == nullptr || kind->geometry.empty()) continue;
    root.fail("geometry", fmt::format("[geometry] has no key '{}'", shortened(key.str())),
              fmt::format("write {} = {}: it is {}", kind->geometry, toml_string(*name), kind->what));
  }
}

}  // namespace

Description read_description(const std::filesystem::path& path) {
  return parse_description(read_all(path, "Give the path of a model.toml", largest_description), path);
}

Description parse_description(const std::string& text, const std::filesystem::path& path) {
  const std::string file = path.string();
  Description result;
  result.file = path;
  result.text = text;
  const toml::table table = parse_toml(result.text, file);
  const toml::table empty;
  const TomlTable root(table, "", file, keys_of(""));
  const auto optional_table = [&](std::string_view key, const Keys& keys) {
    return root.has(key) ? root.table(key, keys)
                         : TomlTable(empty, std::string("[").append(key).append("]"), file, keys);
  };

  refuse_files_under_other_keys(table, root);
  const TomlTable geometry = root.table("geometry", keys_of("[geometry]"));
  const TomlTable mesh = optional_table("mesh", keys_of("[mesh]"));
  const TomlTable storage = optional_table("storage", keys_of("[storage]"));
  const std::string_view kind = geometry.only_one_of(alternatives_of("[geometry]"));

  result.name = read_name(root);
  result.geometry = read_geometry(geometry, kind, path.parent_path());
  result.scale = geometry.positive("scale", 1.0);
  result.analysis = read_analysis(root, kind);
  result.thickness = read_thickness(root, result.analysis);
  result.mesh = read_mesh_options(mesh, kind);
  const int dimension = result.analysis == Analysis::solid ? 3 : 2;
  result.materials = read_materials(root, dimension);
  keep_regions(geometry, result.geometry, result.materials);
  result.scope = read_scope(storage, dimension);
  if (result.scope == Scope::none) check_without_greens(root, storage);
  if (root.has("fixed") || result.scope != Scope::none) result.fixed = read_fixed(root, dimension);
  result.loads = read_loads(root, dimension);
  result.layers = read_layers(storage, result.scope);
  result.precision = read_precision(storage);
  result.form = read_form(storage);
  result.tolerance = read_tolerance(storage, result.form);
  if (root.has("overlay")) {
    result.overlay =
        read_overlay(root.table("overlay", keys_of("[overlay]")), dimension, result.scope, result.layers);
  }
  if (root.has("dynamics")) {
    result.dynamics = read_dynamics(root.table("dynamics", keys_of("[dynamics]")), result.scope);
  }
  return result;
}

}  // namespace palpate
