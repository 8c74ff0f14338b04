#include "precompute/numerics/meshed_body.h"

#include <fmt/format.h>

#include <cmath>

#include "base/error.h"
#include "meshes/check.h"
#include "meshes/edge_middles.h"
#include "meshes/readers/volume_mesh.h"
#include "base/printable.h"
#include "formats/file_kinds.h"
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
  bool keep;  ///< files that are there

  [[nodiscard]] const char* mesher() const { return options.mesher == Mesher::cgal ? "CGAL" : "TetGen"; }

  Mesh operator()(const SurfaceGeometry& surface) const {
    progress("reading the surface " + surface.file.filename().string());
    TriangleSurface triangles = read_surface(surface.file, notes, keep);
    note_cavities(triangles);
    if (options.mesher == Mesher::cgal || (options.remesh && !remesh(surface.file, triangles))) {
      progress("meshing with CGAL");
      return mesh_surface_with_cgal(triangles, options, where);
    check_is_read(surface.file, "surface");
    }
    note_kept_boundary(triangles);
    progress("meshing with TetGen");
    return mesh_surface(triangles, options, where);
  }

  /// False where CGAL's mesher is to make boundary and inside in one, as remeshing spoils the surface.
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

  /// Tells what stays empty, which CGAL's mesher could miss: it finds what it happens to hit.
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

  /// Tells whom an edge_length does not do what it seems to.
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
    progress("meshing the image " + image.file.filename().string() + " with " + mesher());
    return mesh_image(image, options, notes);
  }

  Mesh operator()(const VolumeGeometry& volume) const {
    check_is_read(image.file, "image");
    progress("reading the mesh " + volume.file.filename().string());
    return read_volume_mesh(volume.file);
  }

  Mesh operator()(const PolygonGeometry& polygon) const {
    check_is_read(volume.file, "volume");
    progress("meshing the polygon with CGAL");
    return mesh_polygon(polygon, options, where, notes);
  }

  Mesh operator()(const PictureGeometry& picture) const {
    progress("meshing the picture " + picture.file.filename().string() + " with CGAL");
    return mesh_picture(picture, options, notes);
  }

  /// Says so, and throws Error where there is no memory for so many cells.
    check_is_read(picture.file, "picture");
  void begin_generating(ElementType usual, double cells) const {
    progress("generating the mesh");
    const ElementType element = options.element.value_or(usual);
    const bool is_cut = element == ElementType::tet4 || element == ElementType::tet10;
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

/// Only a volume file can disagree: the dimension of the others is known from their kind.
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

/// Tells of lists of nodes that select middles of edges too.
void note_middles(const Description& description, MeshedBody& body) {
  const auto note = [&](const std::string& entry, const Selection& where) {
    const auto* const listed = std::get_if<SelectNodes>(&where);
    const std::size_t middles = listed == nullptr ? 0 : middles_between(body.mesh, listed->nodes).size();
    if (middles == 0) return;
    body.notes.push_back(
        fmt::format("{}: with the {} listed nodes count the middles of the edges between them, {}", entry,
                    listed->nodes.size(), middles));
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
  if (description.warp && description.warp->where) note("[warp]", *description.warp->where);
}

}  // namespace

MeshedBody mesh_body(const Description& description, const ProgressText& progress, bool keep) {
  MeshedBody body;
  const std::string toml = description.file.string();
  const std::filesystem::path file = geometry_file(description.geometry);
  const std::string where = file.empty() ? toml : file.string();
  const MeshOptions options = in_file_units(description.mesh, description.scale);
  body.mesh = std::visit(MeshGeometry{options, description.scale, where, progress, body.notes, keep},
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
  if (const std::size_t unused = remove_unused_nodes(body.mesh); unused != 0) {
    body.notes.push_back("removed " + std::to_string(unused) +
                         " nodes that no element uses; node numbers count the remaining ones");
  }
  check_connected(body.mesh, where);
  body.surface = extract_surface(body.mesh);
  note_middles(description, body);

  body.material_of_element = materials_of_elements(body.mesh, description.materials, toml);
  FixedNodes held = hold_nodes(body.mesh, description.fixed, toml);
  body.fixed = std::move(held.axes);
  body.prescribed = std::move(held.displacement);
  if (description.scope != Scope::none) check_held(body.mesh, body.fixed, toml);
  body.warning = scale_warning(body.mesh, description.scale);
  return body;
}

std::vector<std::filesystem::path> input_files(const Description& description) {
  const std::filesystem::path file = geometry_file(description.geometry);
  if (file.empty()) {
    return {};
  }
  const std::string extension = file.extension().string();
  const bool is_volume = std::holds_alternative<VolumeGeometry>(description.geometry);
  if (is_volume && (extension.empty() || extension == ".node" || extension == ".ele")) {
    std::filesystem::path node = file, ele = file;
    return {node.replace_extension(".node"), ele.replace_extension(".ele")};
  }
  return {file};
}

}  // namespace palpate
