// Export of the visible surface as files.
#pragma once

#include <string>
#include <vector>

#include "meshes/element_type.h"
#include "runtime/scene/scene.h"

namespace palpate {

/// Returns binary STL of the visible, displaced triangles: those of the patch (null: none) replace the hidden
/// ones. The picture fits (scene.h). Throws Error if there are no triangles.
std::string surface_stl(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch);

/// Visible mesh of a body with its values.
struct SeenMesh {
  ElementType cell = ElementType::tri3;  ///< line2: boundary of a body in the plane without triangles
  std::vector<Index> cells;              ///< [triangles x 3] or [lines x 2] node numbers
  std::vector<Vec3> nodes;               ///< [n] displaced nodes of the scene, then of the patch [m]
  std::vector<double> displacement;      ///< [n x 3] from the position without loads [m]
  std::vector<double> von_mises;         ///< [n] NaN where unknown [Pa]
  std::vector<double> pressure;          ///< [n] contact pressure [Pa]
};

/// Builds the visible mesh. The picture fits (scene.h); the triangles are those of surface_stl.
SeenMesh seen_mesh(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch);

/// Returns the same as VTK XML, with nodal `displacement`, `von_mises` and `pressure`.
std::string surface_vtu(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch);

}  // namespace palpate
