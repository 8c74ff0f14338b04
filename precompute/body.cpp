#include "precompute/body.h"

#include <type_traits>

#include "meshes/check.h"
#include "meshes/volume_mesh.h"
#include "precompute/image_mesh.h"
#include "precompute/surface_input.h"
#include "precompute/tetgen_mesh.h"

namespace palpate {
namespace {

/// The options with lengths in the geometry's own unit.
MeshOptions in_file_units(MeshOptions options, double scale) {
  if (options.edge_length) {
    *options.edge_length /= scale;
  }
  options.facet_distance /= scale;
  return options;
}

/// Turns each kind of geometry into tetrahedra, in the geometry's own unit.
class Mesher {
 public:
  Mesher(const MeshOptions& options, const ProgressText& progress, std::vector<std::string>& notes)
      : options_(options), progress_(progress), notes_(notes) {}

  Mesh operator()(const SurfaceGeometry& surface) const {
    progress_("reading the surface " + surface.file.filename().string());
    const auto remesh_to = options_.remesh ? options_.edge_length : std::nullopt;
    const TriangleSurface triangles = read_surface(surface.file, remesh_to, notes_);
    progress_("meshing with TetGen");
    return mesh_surface(triangles, options_, surface.file.string());
  }

  Mesh operator()(const ImageGeometry& image) const {
    progress_("meshing the image " + image.file.filename().string() + " with CGAL");
    return mesh_image(image, options_, notes_);
  }

  Mesh operator()(const VolumeGeometry& volume) const {
    progress_("reading the mesh " + volume.file.filename().string());
    return read_volume_mesh(volume.file);
  }

  template <typename Shape>
  Mesh operator()(const Shape& shape) const {
    progress_("generating the mesh");
    return generate(shape);
  }

 private:
  const MeshOptions& options_;
  const ProgressText& progress_;
  std::vector<std::string>& notes_;
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

/// Union of the selections. [N]
std::vector<std::uint8_t> select_fixed(const Mesh& mesh, const Description& description) {
  std::vector<std::uint8_t> fixed(mesh.nodes.size(), 0);
  for (std::size_t s = 0; s < description.fixed.size(); ++s) {
    const std::string where = description.file.string() + ": [[fixed]] number " + std::to_string(s + 1);
    const std::vector<std::uint8_t> selected = select_nodes(mesh, description.fixed[s], where);
    for (std::size_t i = 0; i < fixed.size(); ++i) {
      fixed[i] |= selected[i];
    }
  }
  return fixed;
}

}  // namespace

MeshedBody mesh_body(const Description& description, const ProgressText& progress) {
  MeshedBody body;
  const MeshOptions options = in_file_units(description.mesh, description.scale);
  body.mesh = std::visit(Mesher(options, progress, body.notes), description.geometry);
  for (Vec3& x : body.mesh.nodes) {
    x *= description.scale;
  }

  progress("checking the mesh");
  const std::filesystem::path file = geometry_file(description.geometry);
  const std::string where = file.empty() ? description.file.string() : file.string();
  orient_elements(body.mesh, where);
  if (const std::size_t unused = remove_unused_nodes(body.mesh); unused != 0) {
    body.notes.push_back("removed " + std::to_string(unused) +
                         " nodes that no element uses; node numbers count the remaining ones");
  }
  check_connected(body.mesh, where);
  body.surface = extract_surface(body.mesh);
  body.fixed = select_fixed(body.mesh, description);
  check_held(body.mesh, body.fixed, description.file.string());
  if (const std::string warning = scale_warning(body.mesh); !warning.empty()) {
    body.notes.push_back(warning);
  }
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
