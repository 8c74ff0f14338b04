#include "precompute/numerics/meshed_body.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "base/error.h"
#include "base/printable.h"
#include "formats/file_kinds.h"
#include "meshes/check.h"
#include "meshes/edge_middles.h"
#include "meshes/quality.h"
#include "meshes/readers/volume_mesh.h"
#include "precompute/geometry/cgal_surface_mesh.h"
#include "precompute/geometry/image_mesh.h"
#include "precompute/geometry/material_parts.h"
#include "precompute/geometry/mesh_size.h"
#include "precompute/geometry/picture.h"
#include "precompute/geometry/plane_mesh.h"
#include "precompute/geometry/tetgen_mesh.h"
#include "precompute/numerics/fixed_nodes.h"
#include "precompute/surfaces/shells.h"
#include "precompute/surfaces/surface_input.h"

namespace palpate {
namespace {

constexpr double unnoticed_difference = 0.1;  // of edge lengths

/// The options with lengths in the geometry's own unit.
MeshOptions in_file_units(MeshOptions options, double scale) {
  if (options.edge_length) {
    *options.edge_length /= scale;
  }
  options.facet_distance /= scale;
  return options;
}

/// Meshes each kind of geometry, in the geometry's own unit.
struct MeshGeometry {
  const MeshOptions& options;
  double scale;  ///< [m] of the geometry's unit
  const std::string& where;
  const ProgressText& progress;
  std::vector<std::string>& notes;
  MeshGroups& groups;
  bool keep;  ///< keep existing files

  [[nodiscard]] const char* mesher() const { return options.mesher == Mesher::cgal ? "CGAL" : "TetGen"; }

  Mesh operator()(const SurfaceGeometry& surface) const {
    check_is_read(surface.file, "surface");
    progress("reading the surface " + surface.file.filename().string());
    TriangleSurface triangles = read_surface(surface.file, notes, keep);
    note_cavities(triangles);
    if (options.mesher == Mesher::cgal || (options.remesh && !remesh(surface.file, triangles))) {
      progress("meshing with CGAL");
      return mesh_surface_with_cgal(triangles, options, where);
    }
    note_kept_boundary(triangles);
    progress("meshing with TetGen");
    return mesh_surface(triangles, options, where);
  }

  /// Remeshes the surface. False if CGAL's mesher is to mesh boundary and inside at once, because remeshing
  /// spoils the surface.
  [[nodiscard]] bool remesh(const std::filesystem::path& file, TriangleSurface& triangles) const {
    progress("remeshing the surface");
    Remeshing remeshed = remesh_surface(file, triangles, *options.edge_length);
    if (remeshed.problem.empty()) {
      triangles = std::move(remeshed.surface);
      return true;
    }
    const std::string what = "remeshed to edge_length, the surface " + remeshed.problem;
    const bool is_hollow = !cavities_of(triangles).empty();
    if (options.mesher_chosen || is_hollow) {
      throw Error(
          what, where,
          is_hollow
              ? "use another edge_length, or remove remesh from [mesh], so that the file's triangles are kept"
              : "set mesher = \"cgal\" in [mesh] and remove remesh: CGAL's mesher makes a boundary of its "
                "own; "
                "or use another edge_length");
    }
    notes.push_back(what + "; CGAL's mesher was used on the surface as it is (mesher = \"cgal\")");
    return false;
  }

  /// Reports cavities. Throws Error for CGAL's mesher, which could miss them: it finds only what it happens
  /// to hit.
  void note_cavities(const TriangleSurface& triangles) const {
    const std::vector<TriangleSurface> cavities = cavities_of(triangles);
    if (cavities.empty()) return;
    double volume = 0.0;
    for (const TriangleSurface& cavity : cavities) volume -= enclosed_volume(cavity);
    notes.push_back(fmt::format("{} in the body {}, of {:.4g} cm3: nothing is in there",
                                cavities.size() == 1 ? "a shell" : fmt::format("{} shells", cavities.size()),
                                cavities.size() == 1 ? "is a cavity" : "are cavities",
                                volume * std::pow(100.0 * scale, 3)));
    if (options.mesher == Mesher::cgal)
      throw Error("the surface has cavities, which CGAL's mesher may miss", where,
                  R"(set mesher = "tetgen" in [mesh], or remove the inner shells from the surface)");
  }

  /// Reports that an edge_length does not apply to the kept boundary.
  void note_kept_boundary(const TriangleSurface& triangles) const {
    if (!options.edge_length || options.remesh) {
      return;
    }
    const double kept = mean_edge_length(triangles);
    if (std::abs(kept / *options.edge_length - 1.0) > unnoticed_difference) {
      notes.push_back(
          fmt::format("the boundary keeps the file's triangles, of edge {:.3g} m in the mean; edge_length = "
                      "{:.3g} m is for "
                      "the inside alone: set remesh = true in [mesh] to have it on the boundary too",
                      kept * scale, *options.edge_length * scale));
    }
  }

  Mesh operator()(const ImageGeometry& image) const {
    check_is_read(image.file, "image");
    progress("meshing the image " + image.file.filename().string() + " with " + mesher());
    return mesh_image(image, options, notes);
  }

  Mesh operator()(const VolumeGeometry& volume) const {
    check_is_read(volume.file, "volume");
    progress("reading the mesh " + volume.file.filename().string());
    return read_volume_mesh(volume.file, &groups);
  }

  Mesh operator()(const PolygonGeometry& polygon) const {
    progress("meshing the polygon with CGAL");
    return mesh_polygon(polygon, options, where, notes);
  }

  Mesh operator()(const PictureGeometry& picture) const {
    check_is_read(picture.file, "picture");
    progress("meshing the picture " + picture.file.filename().string() + " with CGAL");
    return mesh_picture(picture, options, notes);
  }

  /// Reports the generation, and throws Error if there is no memory for so many cells.
  void begin_generating(ElementType usual, double cells) const {
    progress("generating the mesh");
    const ElementType element = options.element.value_or(usual);
    const bool is_cut = traits(element).corners == 4 && traits(element).dimension == 3;
    check_mesh_room(cells * (is_cut ? 6.0 : element == ElementType::tri3 ? 2.0 : 1.0), element, where);
  }

  Mesh operator()(const RectangleShape& rectangle) const {
    begin_generating(ElementType::quad4, 1.0 * rectangle.cells[0] * rectangle.cells[1]);
    return generate(rectangle, options.element.value_or(ElementType::quad4));
  }

  Mesh operator()(const BoxShape& box) const {
    begin_generating(ElementType::tet4, 1.0 * box.cells[0] * box.cells[1] * box.cells[2]);
    return generate(box, options.element == ElementType::hex8 ? ElementType::hex8 : ElementType::tet4);
  }

  Mesh operator()(const CylinderShape& cylinder) const {
    begin_generating(ElementType::tet4,
                     1.0 * cylinder.cells_across * cylinder.cells_across * cylinder.cells_along);
    return generate(cylinder);
  }

  Mesh operator()(const SphereShape& sphere) const {
    begin_generating(ElementType::tet4, std::pow(sphere.cells_across, 3));
    return generate(sphere);
  }
};

std::filesystem::path geometry_file(const Geometry& geometry) {
  return std::visit(
      [](const auto& source) -> std::filesystem::path {
        if constexpr (requires { source.file; }) {
          return source.file;
        } else {
          return {};
        }
      },
      geometry);
}

/// Throws Error if the mesh and model.toml differ in dimension, which only a volume file can cause: the
/// dimension of other geometries follows from their kind.
void check_dimension(const Mesh& mesh, const Description& description, const std::string& where) {
  const std::string element = traits(mesh.element).name;
  if (mesh.dimension() == 2 && description.analysis == Analysis::solid) {
    throw Error("the mesh lies in the plane (" + element + "), but model.toml has no plane", where,
                R"(add plane = "stress" (a thin sheet) or plane = "strain" (a slice of a long body) to )" +
                    description.file.string());
  }
  if (mesh.dimension() == 3 && description.analysis != Analysis::solid) {
    throw Error("the mesh is in space (" + element + "), but model.toml has plane", where,
                "remove plane from " + description.file.string());
  }
}

/// Calls work(entry, listed) for each list of nodes in a description.
template <class Work>
void for_node_lists(const Description& description, const Work& work) {
  const auto note = [&](const std::string& entry, const Selection& where) {
    if (const auto* const listed = std::get_if<SelectNodes>(&where)) work(entry, *listed);
  };
  for (std::size_t k = 0; k < description.fixed.size(); ++k)
    note(fmt::format("[[fixed]] number {}", k + 1), description.fixed[k].where);
  for (std::size_t k = 0; k < description.loads.size(); ++k) {
    std::visit(
        [&](const auto& load) {
          if constexpr (requires { load.where; }) note(fmt::format("[[load]] number {}", k + 1), load.where);
        },
        description.loads[k]);
  }
  if (description.overlay) {
    for (const Selection& where : description.overlay->regions) note("[[overlay.region]]", where);
  }
}

/// Reports lists of nodes that also select middles of edges.
void note_middles(const Description& description, MeshedBody& body) {
  for_node_lists(description, [&](const std::string& entry, const SelectNodes& listed) {
    const std::size_t middles = middles_between(body.mesh, listed.nodes).size();
    if (middles == 0) return;
    body.notes.push_back(
        fmt::format("{}: the {} listed nodes include the middles of the edges between them, {}", entry,
                    listed.nodes.size(), middles));
  });
}

/// Largest number in lists of nodes; -1 if there are no lists.
Index largest_listed_node(const Description& description) {
  Index largest = -1;
  for_node_lists(description, [&](const std::string&, const SelectNodes& listed) {
    for (const Index node : listed.nodes) largest = std::max(largest, node);
  });
  return largest;
}

/// Number of the first node without an element; the number of nodes if there is none.
Index first_unused_node(const Mesh& mesh) {
  std::vector<std::uint8_t> used(mesh.nodes.size(), 0);
  for (const Index node : mesh.connectivity) used[static_cast<std::size_t>(node)] = 1;
  return static_cast<Index>(std::ranges::find(used, 0) - used.begin());
}

/// All groups of the elements, with their names: "1 (liver), 2".
std::string region_list(const MeshGroups& groups, const Mesh& mesh) {
  std::set<Index> present(mesh.regions.begin(), mesh.regions.end());
  for (const auto& [element, region] : groups.more) present.insert(region);
  std::string text;
  for (const Index region : present) {
    text += fmt::format("{}{}", text.empty() ? "" : ", ", region);
    for (const auto& [name, number] : groups.number_of)
      if (number == region) text += " (" + name + ")";
  }
  return text + (groups.hint.empty() ? "" : "; " + groups.hint);
}

/// The materials with numbers for names of regions. The region of an element in several groups becomes the
/// one that a material uses. Throws Error for regions that do not exist, and for an element that two
/// materials claim.
std::vector<MaterialPart> in_numbers(std::vector<MaterialPart> parts, const MeshGroups& groups, Mesh& mesh,
                                     const std::string& toml) {
  std::map<Index, std::size_t> part_of;  // a region
  std::set<Index> present(mesh.regions.begin(), mesh.regions.end());
  for (const auto& [element, region] : groups.more) present.insert(region);
  for (std::size_t k = 0; k < parts.size(); ++k) {
    MaterialPart& part = parts[k];
    const auto fail = [&](const std::string& region) {
      throw Error("no element has the region " + region,
                  fmt::format("{}: [[material]] number {}", toml, k + 1),
                  "the body has the regions " + region_list(groups, mesh));
    };
    for (const std::string& name : part.region_names) {
      const auto found = groups.number_of.find(name);
      if (found == groups.number_of.end()) fail("\"" + printable(name) + "\"");
      part.regions.push_back(found->second);
    }
    part.region_names.clear();
    for (const Index region : part.regions) {
      if (!present.contains(region)) fail(std::to_string(region));
      part_of.emplace(region, k);
    }
  }
  for (const auto& [element, region] : groups.more) {
    Index& first = mesh.regions[element];
    const auto wanted = part_of.find(region), has = part_of.find(first);
    if (wanted == part_of.end()) continue;
    if (has == part_of.end()) {
      first = region;
    } else if (has->second != wanted->second) {
      throw Error(
          fmt::format("overlapping regions: an element is in the regions {} and {}, which [[material]] "
                      "number {} and number {} claim",
                      first, region, has->second + 1, wanted->second + 1),
          toml, "give the regions that overlap one material, or make groups that do not overlap");
    }
  }
  present = {mesh.regions.begin(), mesh.regions.end()};
  for (MaterialPart& part : parts)
    std::erase_if(part.regions, [&](Index region) { return !present.contains(region); });
  return parts;
}

constexpr double most_held = 1.0 / 3.0;  // of the nodes
constexpr double most_across = 0.9;      // of the elements that reach from surface to surface
constexpr double least_shape = 0.01;     // of an element

/// Reports conditions, mostly mistakes, that make a body feel different from the intended one.
std::vector<std::string> doubts_of(const MeshedBody& body) {
  std::vector<std::string> doubts;
  const Mesh& mesh = body.mesh;
  const auto nodes = static_cast<double>(mesh.nodes.size()), elements = static_cast<double>(mesh.elements());
  const auto held =
      static_cast<double>(std::ranges::count_if(body.fixed, [](std::uint8_t axes) { return axes != 0; }));
  if (held > most_held * nodes) {
    doubts.push_back(
        fmt::format("{:.0f} % of the nodes are held ({} of {}): the body can hardly give way; hold "
                    "less of it, along another axis or by percent = 1, under [[fixed]]",
                    100.0 * held / nodes, held, nodes));
  }
  std::vector<std::uint8_t> outside(mesh.nodes.size(), 0);
  for (const Index node : body.surface.nodes) outside[static_cast<std::size_t>(node)] = 1;
  const auto corners = static_cast<std::size_t>(traits(mesh.element).corners);
  double across = 0.0;
  for (Index e = 0; e < mesh.elements(); ++e) {
    across += std::ranges::all_of(mesh.element_nodes(e).first(corners),
                                  [&](Index node) { return outside[static_cast<std::size_t>(node)] != 0; })
                  ? 1.0
                  : 0.0;
  }
  if (across > most_across * elements && mesh.element != ElementType::tet10) {
    doubts.push_back(
        fmt::format("the body is one element thick ({:.0f} % of its elements have all corners on its "
                    "surface) and bends too stiffly: use element = \"tet10\" or a smaller "
                    "edge_length in [mesh]",
                    100.0 * across / elements));
  }
  const QualityReport quality = measure_quality(mesh);
  if (quality.min_shape < least_shape) {
    doubts.push_back(
        fmt::format("an element is all but flat (shape {:.3f}, angles {:.1f} to {:.1f} degrees, at "
                    "({:.4g}, {:.4g}, {:.4g}) m): forces near it are wrong; use another edge_length "
                    "in [mesh], or remesh",
                    quality.min_shape, quality.min_angle, quality.max_angle, quality.worst_centroid.x(),
                    quality.worst_centroid.y(), quality.worst_centroid.z()));
  }
  return doubts;
}

}  // namespace

MeshedBody mesh_body(const Description& description, const ProgressText& progress, bool keep) {
  MeshedBody body;
  const std::string toml = description.file.string();
  const std::filesystem::path file = geometry_file(description.geometry);
  const std::string where = file.empty() ? toml : file.string();
  const MeshOptions options = in_file_units(description.mesh, description.scale);
  MeshGroups groups;
  body.mesh = std::visit(MeshGeometry{options, description.scale, where, progress, body.notes, groups, keep},
                         description.geometry);
  for (Vec3& x : body.mesh.nodes) {
    x *= description.scale;
  }

  progress("checking the mesh");
  check_dimension(body.mesh, description, where);
  const std::size_t turned = orient_elements(body.mesh, where);
  if (turned != 0 && turned != static_cast<std::size_t>(body.mesh.elements()))
    body.notes.push_back(fmt::format("{} of {} elements list their nodes the other way round and were turned",
                                     turned, body.mesh.elements()));
  if (options.element) {
    body.mesh = with_elements(std::move(body.mesh), *options.element, where);
  }
  const Index first_unused = first_unused_node(body.mesh);
  if (const std::size_t unused = remove_unused_nodes(body.mesh); unused != 0) {
    if (largest_listed_node(description) > first_unused) {
      throw Error(
          fmt::format("the file has {} nodes that no element uses, and without them the numbers under "
                      "nodes would mean others",
                      unused),
          where,
          "remove these nodes in the program that wrote the file, and count anew; or select by box, "
          "half_space, sphere, lowest or tag");
    }
    body.notes.push_back(fmt::format("removed {} nodes that no element uses", unused));
  }
  check_connected(body.mesh, where);
  body.surface = extract_surface(body.mesh);
  note_middles(description, body);

  body.material_of_element =
      materials_of_elements(body.mesh, in_numbers(description.materials, groups, body.mesh, toml), toml);
  FixedNodes held = hold_nodes(body.mesh, description.fixed, toml);
  body.fixed = std::move(held.axes);
  body.prescribed = std::move(held.displacement);
  if (description.scope != Scope::none) check_held(body.mesh, body.fixed, toml);
  body.warning = scale_warning(body.mesh, description.scale);
  body.doubts = doubts_of(body);
  return body;
}

std::vector<std::filesystem::path> input_files(const Description& description) {
  const std::filesystem::path file = geometry_file(description.geometry);
  if (file.empty()) {
    return {};
  }
  return std::holds_alternative<VolumeGeometry>(description.geometry)
             ? volume_mesh_files(file)
             : std::vector<std::filesystem::path>{file};
}

}  // namespace palpate
