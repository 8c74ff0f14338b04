#include "precompute/draft/draft.h"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "base/error.h"
#include "base/json_text.h"
#include "base/printable.h"
#include "base/toml_text.h"
#include "base/write_file.h"
#include "formats/outputs/output_paths.h"
#include "precompute/description/read_description.h"

namespace palpate {
namespace {

constexpr std::string_view repaired_mark = "# repaired by palpate-precompute\n";  // OutputKind::surface
constexpr double picture_thickness = 0.01;                                        // [m]
constexpr std::array<double, 3> wrap_offsets = {usual_wrap_offset, 0.15, 0.3};    // relative to the edge

/// Edge length in the shape's unit. Of the surface nodes of tet10 three in four are middles of edges.
double edge_in_file(const Shape& shape, const DraftOptions& options) {
  const int nodes = options.shape.nodes_of(shape.kind);
  if (shape.kind == ShapeKind::picture) return shape.boundary / nodes;
  return edge_for_nodes(shape.boundary, options.tet10 ? nodes / 4 : nodes);
}

double edge_length(const Shape& shape, const UnitGuess& unit, const DraftOptions& options) {
  return edge_in_file(shape, options) * unit.unit.metres;
}

DraftValues values_of(const Shape& shape, const DraftOptions& options) {
  return options.values.value_or(usual_values(shape.kind));
}

/// Unit of a picture, which has none: its body is 10 cm long.
UnitGuess unit_of_pixels(double longest_side) {
  const std::string metres = fmt::format("{:.3g}", 0.1 / longest_side);
  return {*read_unit(metres), fmt::format("the body is {} pixels long, and so 10 cm", longest_side)};
}

/// Unit of the lengths as read: millimetres for an image whose header has a unit.
UnitGuess unit_of(const Shape& shape, const DraftOptions& options) {
  if (options.unit) {
    LengthUnit given = *options.unit;
    if (shape.unit > 0.0) given.metres /= shape.unit;
    return {given, "it was given"};
  }
  if (shape.unit > 0.0) return {*read_unit("mm"), "the image's header says its unit"};
  if (shape.kind == ShapeKind::picture) return unit_of_pixels(shape.size.maxCoeff());
  return guess_unit(shape.size.maxCoeff());
}

constexpr std::string_view drafted_mark = "# Drafted by palpate-precompute from ";

/// True if a description was made from this shape, or from its repaired surface.
bool is_made_from(const Description& description, const std::filesystem::path& file) {
  const std::filesystem::path source = std::visit(
      [](const auto& geometry) -> std::filesystem::path {
        if constexpr (requires { geometry.file; }) return geometry.file;
        return {};
      },
      description.geometry);
  std::error_code failed;
  const auto plain = [](const std::filesystem::path& path) {
    return std::filesystem::absolute(path).lexically_normal();
  };
  if (source.empty()) return false;
  if (plain(source) == plain(file) || std::filesystem::equivalent(source, file, failed)) return true;
  const std::string name = source.filename().string();
  return name.starts_with(shape_name(file) + ".repaired") && name.ends_with(".off") &&
         description.text.starts_with(std::string(drafted_mark) + printable(file.filename().string()) + ".");
}

/// Keeps an existing description, which is the user's. Throws Error if it is of another file, whose name
/// differs in the ending only.
void use_existing(const std::filesystem::path& file, const std::filesystem::path& description,
                  bool has_options, const Tell& tell) {
  if (has_options)
    throw Error("is there already, and these options are for a new one", description.string(),
                "give --renew to write it anew, or change it in an editor and give it to palpate-precompute");
  if (!is_made_from(read_description(description), file)) {
    throw Error("was not made from " + printable(file.filename().string()), description.string(),
                "to use it as it is, palpate-precompute " + shell_word(description.string()) +
                    "; --renew writes it anew from " + shell_word(file.string()));
  }
  tell(printable(description.string()) + " is there and is used as it is (--renew writes it anew)");
  std::error_code failed;
  const auto shape_time = std::filesystem::last_write_time(file, failed);
  if (!failed && shape_time > std::filesystem::last_write_time(description, failed) && !failed)
    tell("note: " + printable(file.string()) + " is newer: --renew takes it into account");
}

/// Throws Error unless the name is UTF-8, as the description contains it.
void expect_utf8_name(const std::filesystem::path& file) {
  const nlohmann::json name = file.filename().string();
  if (nlohmann::json::parse(json_text(name)) != name)
    throw Error("its name is not UTF-8, and a description in TOML cannot have it", file.string(),
                "rename the file");
}

/// Repaired surface of a shape, in a file beside it.
class RepairedFile {
 public:
  RepairedFile(std::filesystem::path file, std::filesystem::path folder, bool keep)
      : file_(std::move(file)), folder_(std::move(folder)), keep_(keep) {}

  /// Writes the surface and returns its path: the shape's own file if nothing was repaired.
  std::filesystem::path write(const Shape& shape) {
    if (shape.repaired.triangles.empty()) return file_;
    std::string text = off_text(shape.repaired);
    text.insert(text.find('\n') + 1, std::string(repaired_mark));
    const auto write = path_.empty() && keep_ ? write_new_file : write_file;
    if (path_.empty()) path_ = free_path();
    write(path_, text);
    return path_;
  }

 private:
  [[nodiscard]] std::filesystem::path free_path() const {
    const std::string stem = (folder_ / (shape_name(file_) + ".repaired")).string();
    std::filesystem::path path = stem + ".off";
    for (int k = 2; keep_ && std::filesystem::exists(std::filesystem::symlink_status(path)); ++k)
      path = fmt::format("{}-{}.off", stem, k);
    OutputPaths outputs({}, keep_);
    outputs.add_input(file_, "the surface");
    return outputs.add(path, OutputKind::surface, "the repaired surface");
  }

  std::filesystem::path file_, folder_, path_;
  bool keep_;
};

/// Some surfaces intersect themselves after remeshing to the edge length of the mesh, where they are thinner
/// than that. These are wrapped, with growing offset, until they do not; the last wrapping is accepted.
std::filesystem::path make_meshable(const std::filesystem::path& file, const std::filesystem::path& folder,
                                    double edge, bool keep, Shape& shape) {
  RepairedFile repaired(file, folder, keep);
  std::filesystem::path path = repaired.write(shape);
  std::vector<std::string> notes;
  const TriangleSurface surface = read_surface(path, notes);
  std::string problem = remesh_surface(path, surface, edge).problem;
  if (problem.empty()) return path;
  const std::string why = "with the edge length of the mesh it " + problem.substr(0, problem.find(':'));
  for (const double offset : wrap_offsets) {
    shape.repaired = wrapped_surface(surface, edge, offset, file.string());
    path = repaired.write(shape);
    problem = remesh_surface(path, shape.repaired, edge).problem;
    if (!problem.empty() && offset != wrap_offsets.back()) continue;
    shape.remesh = problem.empty();
    shape.repairs.push_back(fmt::format("as {}, it was wrapped: a new surface lies around it at {:.3g} units",
                                        why, offset * edge));
    break;
  }
  return path;
}

void tell_decisions(const Shape& shape, const UnitGuess& unit, const DraftOptions& options,
                    const Tell& tell) {
  tell(fmt::format("unit: {}, as {}; another one: --unit {}", unit.unit.name, unit.why, unit_choices));
  const double edge = edge_length(shape, unit, options);
  const DraftValues values = values_of(shape, options);
  const bool is_picture = shape.kind == ShapeKind::picture;
  tell(fmt::format("edge length: {}, for about {} {}nodes", length_text(edge),
                   options.shape.nodes_of(shape.kind), is_picture ? "outline " : "surface "));
  if (is_picture) {
    tell(fmt::format("body: what is {} in the picture, {} thick, which nothing holds",
                     shape.dark ? "dark" : "light", length_text(picture_thickness)));
    tell(fmt::format("jelly: E = {} Pa, nu = {}", values.youngs_modulus, values.poissons_ratio));
    return;
  }
  tell(fmt::format("tissue: E = {} Pa, nu = {}; held: the lowest {} % along {}", values.youngs_modulus,
                   values.poissons_ratio, values.percent, values.down));
}

/// End of a picture's description.
std::string picture_text(const DraftValues& values) {
  return fmt::format(
      "\n[material]\nyoungs_modulus = {}  # pascals: jelly\npoissons_ratio = {}\n"
      "density = {}  # kg/m^3\nfriction = {}  # between the body and a tool\n"
      "\n# Nothing holds the body: it falls and is thrown. To hold it: [[fixed]] (docs/model-toml.md)\n"
      "\n[storage]\nscope = \"none\"  # no Green's functions: it is solved while you touch it "
      "(docs/live.md)\n",
      values.youngs_modulus, values.poissons_ratio, values.density, values.friction);
}

}  // namespace

DraftValues usual_values(ShapeKind kind) {
  DraftValues values;
  if (kind == ShapeKind::picture) {
    values.youngs_modulus = 2e4;
    values.poissons_ratio = 0.3;
    values.density = 1000.0;
  }
  return values;
}

std::filesystem::path draft_file(const std::filesystem::path& shape, const std::filesystem::path& elsewhere) {
  const std::string name = shape_name(shape) + ".model.toml";
  const std::filesystem::path folder = shape.parent_path(), beside = folder / name;
  const bool is_writable = ::access(folder.empty() ? "." : folder.c_str(), W_OK) == 0;
  return is_writable || std::filesystem::exists(beside) ? beside : elsewhere / name;
}

std::string draft_text(const std::filesystem::path& description, const std::filesystem::path& file,
                       const std::string& repaired, const Shape& shape, const UnitGuess& unit,
                       const DraftOptions& options) {
  const DraftValues values = values_of(shape, options);
  const std::string name = file.filename().string();
  const bool is_surface = shape.kind == ShapeKind::surface, is_picture = shape.kind == ShapeKind::picture;
  const int nodes = options.shape.nodes_of(shape.kind);
  std::string text = fmt::format(
      "{}{}. It is yours: change what is wrong, then run\n"
      "#   palpate-precompute {}\n"
      "name = {}\n{}\n[geometry]\n",
      drafted_mark, printable(name), shell_word(description.filename().string()),
      toml_string(values.name.empty() ? shape_name(file) : values.name),
      is_picture ? fmt::format("plane = \"strain\"  # \"stress\" for a thin sheet\n"
                               "thickness = {}  # metres: forces grow with it\n",
                               picture_thickness)
                 : "");
  const bool is_beside = description.parent_path() == file.parent_path();
  text += fmt::format("{} = {}\n",
                      is_surface   ? "surface"
                      : is_picture ? "picture"
                                   : "image",
                      toml_string(!repaired.empty() ? repaired
                                  : is_beside       ? name
                                                    : std::filesystem::absolute(file).string()));
  for (const std::string& repair : shape.repairs) text += "# repaired: " + repair + "\n";
  if (options.shape.range)
    text += fmt::format("range = [{}, {}]  # these values of the image are the body\n",
                        options.shape.range->low, options.shape.range->high);
  if (is_picture) {
    text += fmt::format("dark = {}  # whether what is dark is the body, or what is light\n", shape.dark);
    text += fmt::format("scale = {}  # metres per pixel: {}\n", unit.unit.metres, unit.why);
  } else {
    text += fmt::format("scale = {}  # metres per unit of the file ({}): {}\n", unit.unit.metres,
                        unit.unit.name, unit.why);
  }
  text += fmt::format(
      "\n[mesh]\nedge_length = {:.3g}  # metres: about {} nodes on the {}; half of it makes {} times as "
      "many\n",
      edge_length(shape, unit, options), nodes, is_picture ? "outline" : "surface",
      is_picture ? "two" : "four");
  if (options.tet10 && !is_picture) text += "element = \"tet10\"  # of second order\n";
  if (is_surface)
    text += shape.remesh ? "remesh = true\n"
                         : "remesh = false  # the triangles of the surface are of that size\n";
  if (is_picture) return text + picture_text(values);
  text += fmt::format(
      "\n[material]\nyoungs_modulus = {}  # pascals: soft tissue, about that of healthy liver\n"
      "poissons_ratio = {}  # below 0.5\n"
      "density = {}  # kg/m^3\nfriction = {}  # between the surface and a tool: wet tissue\n",
      values.youngs_modulus, values.poissons_ratio, values.density, values.friction);
  text += fmt::format(
      "\n[[fixed]]  # what is held: as if the body lay on a table\nlowest = {{axis = \"{}\", percent = "
      "{}}}\n",
      values.down, values.percent);
  text +=
      "\n[storage]\nscope = \"surface\"  # \"layers\" keeps what is below too, for overlays "
      "(docs/overlays.md)\n";
  return text;
}

std::filesystem::path draft(const std::filesystem::path& file, const DraftOptions& options, bool has_options,
                            const Tell& tell) {
  std::filesystem::path description = draft_file(file, options.elsewhere);
  const bool is_there = std::filesystem::exists(description);
  if (is_there && !options.renew) {
    use_existing(file, description, has_options, tell);
    return description;
  }
  expect_utf8_name(file);
  expect_writable_folder(description);
  Shape shape = read_shape(file, options.shape);
  for (const std::string& remark : shape.remarks) tell("note: " + remark);
  for (const std::string& repair : shape.repairs) tell("repaired: " + repair);
  const UnitGuess unit = unit_of(shape, options);
  tell_decisions(shape, unit, options, tell);
  std::string repaired;
  if (shape.kind == ShapeKind::surface) {
    const std::size_t told = shape.repairs.size();
    const std::filesystem::path surface =
        options.shape.strict ? file
                             : make_meshable(file, description.parent_path(), edge_in_file(shape, options),
                                             options.keep, shape);
    for (std::size_t i = told; i < shape.repairs.size(); ++i) tell("repaired: " + shape.repairs[i]);
    if (surface != file) {
      repaired = surface.filename().string();
      tell("wrote " + printable(surface.string()) + ", the surface as it was repaired");
    }
  }
  const auto write = is_there ? write_file : write_new_file;
  write(description, draft_text(description, file, repaired, shape, unit, options));
  tell(fmt::format("wrote {}{}: change it and run palpate-precompute {}", printable(description.string()),
                   is_there ? " anew" : "", shell_word(description.string())));
  return description;
}

}  // namespace palpate
