// Geometry of a body as a viewer draws it.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "runtime/background/surface_frames.h"
#include "runtime/body/body.h"
#include "runtime/core/body/patch.h"
#include "runtime/scene/inner_surface.h"

namespace palpate {

/// Drawn geometry of a body. In space it is the surface mesh. In the plane it is all elements if their
/// displacements are known (all free nodes are stored), otherwise the boundary.
struct Scene {
  std::uint32_t number = 0;  ///< number from 1
  int dimension = 3;
  bool is_plane = false;             ///< nodes are all mesh nodes, not the surface nodes
  std::vector<Index> surface_nodes;  ///< if is_plane, those of the surface; else empty: the first nodes are
  std::vector<Vec3> nodes;           ///< [S] positions without loads [m]
  std::vector<std::array<Index, 3>> triangles;  ///< [T]
  std::vector<Index> elements;                  ///< [T] element of each triangle; empty in a recording
  std::vector<std::array<Index, 2>> edges;      ///< edges of the elements, without duplicates
  std::vector<std::uint8_t> held;               ///< [S] see Model::fixed
  std::vector<std::uint8_t> materials;          ///< [T] in space with several materials; else empty
  InnerSurface inner;
  std::vector<Index> order;  ///< [S] node order in messages: neighbours follow each other
};

/// Finer surface of an overlay, which replaces some of a scene's triangles.
struct ScenePatch {
  std::uint32_t number = 0;                     ///< number from 1, assigned by the caller that shows it
  std::vector<Index> surface_nodes;             ///< [m] nodes of Body::simplices that its own nodes are
  std::vector<Index> hidden;                    ///< triangles of the scene that it replaces
  std::vector<Vec3> nodes;                      ///< [m] positions without loads [m]
  std::vector<std::array<Index, 3>> triangles;  ///< in its own node numbers
  std::vector<std::array<Index, 2>> outline;    ///< in the plane: boundary edges
  std::vector<std::uint8_t> materials;          ///< [t] see Scene
};

/// Builds the scene of a body. Throws Error if the model's surface is not that of its mesh.
Scene make_scene(const Body& body, std::uint32_t number);

/// Builds the scene of a body in the plane from the mesh alone; all its elements are drawn.
Scene make_plane_scene(const Model& model, std::uint32_t number);

/// Builds the scene of an overlay on the body of `scene`. Its number stays 0.
ScenePatch make_scene_patch(const Body& body, const Scene& scene, const Patch& patch);

/// True if a picture has values for all nodes of the scene and of the patch (null: none).
bool fits(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch);

/// Builds the scene of a recording: its whole surface with the edges of its triangles.
Scene make_scene(const RecordedSurface& surface, std::uint32_t number);

}  // namespace palpate
