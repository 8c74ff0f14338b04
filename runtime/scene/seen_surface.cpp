#include "runtime/scene/seen_surface.h"

#include <bit>
#include <cmath>
#include <sstream>

#include "base/error.h"
#include "meshes/readers/vtu_writer.h"
#include "runtime/scene/seen_values.h"

namespace palpate {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written as they are in memory");

constexpr std::size_t stl_header = 80;

Vec3 seen(const SeenValues& values, const Scene& scene, const ScenePatch* patch, std::size_t k) {
  const std::size_t nodes = values.scene_nodes();
  const Vec3& without_loads = k < nodes ? scene.nodes[k] : patch->nodes[k - nodes];
  return without_loads + Eigen::Map<const Eigen::Vector3f>(values.displacement(k)).cast<double>();
}

/// Returns node numbers [triangles * 3], those of the patch from S on.
std::vector<Index> seen_triangles(const Scene& scene, const ScenePatch* patch) {
  std::vector<bool> is_hidden(scene.triangles.size());
  if (patch != nullptr) {
    for (const Index t : patch->hidden) is_hidden[static_cast<std::size_t>(t)] = true;
  }
  std::vector<Index> nodes;
  for (std::size_t t = 0; t < scene.triangles.size(); ++t) {
    if (!is_hidden[t]) nodes.insert(nodes.end(), scene.triangles[t].begin(), scene.triangles[t].end());
  }
  if (patch == nullptr) return nodes;
  for (const std::array<Index, 3>& triangle : patch->triangles) {
    for (const Index node : triangle) nodes.push_back(static_cast<Index>(scene.nodes.size()) + node);
  }
  return nodes;
}

template <class Number>
void append(std::string& bytes, Number number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

void append(std::string& bytes, const Vec3& v) {
  for (const double x : v) append(bytes, static_cast<float>(x));
}

}  // namespace

std::string surface_stl(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch) {
  const SeenValues values(picture, scene, patch);
  const std::vector<Index> triangles = seen_triangles(scene, patch);
  if (triangles.empty())
    throw Error("the boundary of a body in the plane has no triangles", "surface.stl", "take surface.vtu");
  std::string bytes = "surface in metres";  // must not begin with "solid"
  bytes.resize(stl_header, ' ');
  append(bytes, static_cast<std::uint32_t>(triangles.size() / 3));
  for (std::size_t at = 0; at < triangles.size(); at += 3) {
    std::array<Vec3, 3> corners;
    for (std::size_t k = 0; k < 3; ++k)
      corners[k] = seen(values, scene, patch, static_cast<std::size_t>(triangles[at + k]));
    append(bytes, Vec3((corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized()));
    for (const Vec3& corner : corners) append(bytes, corner);
    append(bytes, std::uint16_t{0});
  }
  return bytes;
}

SeenMesh seen_mesh(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch) {
  const SeenValues values(picture, scene, patch);
  const std::size_t nodes = values.scene_nodes() + values.patch_nodes();
  SeenMesh mesh;
  mesh.pressure.resize(nodes);
  for (std::size_t k = 0; k < nodes; ++k) {
    mesh.nodes.push_back(seen(values, scene, patch, k));
    mesh.displacement.insert(mesh.displacement.end(), values.displacement(k), values.displacement(k) + 3);
    mesh.von_mises.push_back(values.von_mises(k));
  }
  for (const SeenValues::Pressure& p : values.pressures())
    mesh.pressure[static_cast<std::size_t>(p.node)] = p.value;

  mesh.cells = seen_triangles(scene, patch);
  if (!mesh.cells.empty()) return mesh;
  mesh.cell = ElementType::line2;
  for (const std::array<Index, 2>& edge : scene.edges)
    mesh.cells.insert(mesh.cells.end(), edge.begin(), edge.end());
  return mesh;
}

std::string surface_vtu(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch) {
  const SeenMesh mesh = seen_mesh(picture, scene, patch);
  const std::array<NodalField, 3> fields = {{{"displacement", 3, mesh.displacement},
                                             {"von_mises", 1, mesh.von_mises},
                                             {"pressure", 1, mesh.pressure}}};
  return vtu_text(mesh.nodes, mesh.cell, mesh.cells, fields);
}

}  // namespace palpate
