// The surface as a viewer shows it, as files.
#pragma once

#include <string>

#include "runtime/viewer/scene.h"

namespace palpate {

/// Binary STL of the triangles, where they are seen: those of the patch (null: none) in place of the hidden.
/// The picture fits (wire.h). Throws Error when there are no triangles.
std::string surface_stl(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch);

/// VTK XML of the same, in the plane without triangles of the boundary's lines, with nodal `displacement`
/// without loads to there [m], `von_mises` [Pa] (not a number where it is not known) and `pressure`
/// [Pa].
std::string surface_vtu(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch);

}  // namespace palpate
