// The surface as a viewer shows it, as files.
#pragma once

#include <string>
#include <vector>

#include "meshes/element_type.h"
#include "runtime/scene/scene.h"

namespace palpate {

/// Binary STL of the triangles, where they are seen: those of the patch (null: none) in place of the hidden.
/// The picture fits (scene.h). Throws Error when there are no triangles.
std::string surface_stl(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch);

/// What is seen of a body, with its values.
struct SeenMesh {
  ElementType cell = ElementType::tri3;  ///< or line2: the boundary of a body in the plane without triangles
  std::vector<Index> cells;              ///< [triangles x 3] or [lines x 2] node numbers
  std::vector<Vec3> nodes;               ///< [n] of the scene, then of the patch, where they are seen [m]
  std::vector<double> displacement;      ///< [n x 3] from the place without loads to there [m]
  std::vector<double> von_mises;         ///< [n] not a number where it is not known [Pa]
  std::vector<double> pressure;          ///< [n] of the contact [Pa]
};

/// The picture fits (scene.h); the triangles are those of surface_stl.
SeenMesh seen_mesh(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch);

/// VTK XML of the same, with nodal `displacement`, `von_mises` and `pressure`.
std::string surface_vtu(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch);

}  // namespace palpate
