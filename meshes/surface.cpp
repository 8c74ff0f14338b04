#include "meshes/surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "meshes/error.h"

namespace palpate {
namespace {

/// The face opposite each corner, outward for a positively oriented element.
constexpr std::array<std::array<std::size_t, 3>, 4> outward_faces = {
    {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

struct Face {
  Triangle sorted;  // the same for both elements that share it
  Triangle outward;
};

constexpr const char* remove_overlap = "Remove the elements that overlap or stand twice in the mesh.";

/// The same three nodes, in the same sense of rotation.
bool same_sense(const Triangle& a, const Triangle& b) {
  return a == b || a == Triangle{b[1], b[2], b[0]} || a == Triangle{b[2], b[0], b[1]};
}

std::vector<Face> all_faces(const Mesh& mesh) {
  std::vector<Face> faces;
  faces.reserve(4 * mesh.tets.size());
  for (const Tet& tet : mesh.tets) {
    for (const auto& corner : outward_faces) {
      const Triangle outward = {tet[corner[0]], tet[corner[1]], tet[corner[2]]};
      Triangle sorted = outward;
      std::sort(sorted.begin(), sorted.end());
      faces.push_back({sorted, outward});
    }
  }
  return faces;
}

}  // namespace

Surface extract_surface(const Mesh& mesh) {
  std::vector<Face> faces = all_faces(mesh);
  std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) { return a.sorted < b.sorted; });
  Surface surface;
  for (auto face = faces.begin(); face != faces.end();) {
    const auto end = std::find_if(face, faces.end(), [&](const Face& f) { return f.sorted != face->sorted; });
    if (end - face > 2) {
      throw Error(fmt::format("{} elements share the face of nodes {}, {}, {}", end - face, face->sorted[0],
                              face->sorted[1], face->sorted[2]),
                  "mesh", remove_overlap);
    }
    if (end - face == 2 && same_sense(face[0].outward, face[1].outward)) {
      throw Error(
          fmt::format("two elements overlap: they are on the same side of the face of nodes {}, {}, {}",
                      face->sorted[0], face->sorted[1], face->sorted[2]),
          "mesh", remove_overlap);
    }
    if (end - face == 1) surface.triangles.push_back(face->outward);
    face = end;
  }
  for (const Triangle& t : surface.triangles) surface.nodes.insert(surface.nodes.end(), t.begin(), t.end());
  std::sort(surface.nodes.begin(), surface.nodes.end());
  surface.nodes.erase(std::unique(surface.nodes.begin(), surface.nodes.end()), surface.nodes.end());
  return surface;
}

std::vector<Index> layers_below_surface(const Mesh& mesh, const Surface& surface) {
  constexpr Index unreached = std::numeric_limits<Index>::max();
  std::vector<Index> layer(mesh.nodes.size(), unreached);
  for (const Index node : surface.nodes) layer[static_cast<std::size_t>(node)] = 0;
  bool changed = true;
  for (Index depth = 0; changed; ++depth) {
    changed = false;
    for (const Tet& tet : mesh.tets) {
      const bool touches = std::any_of(
          tet.begin(), tet.end(), [&](Index node) { return layer[static_cast<std::size_t>(node)] == depth; });
      if (!touches) continue;
      for (const Index node : tet) {
        Index& l = layer[static_cast<std::size_t>(node)];
        if (l != unreached) continue;
        l = depth + 1;
        changed = true;
      }
    }
  }
  return layer;
}

}  // namespace palpate
