// What a viewer draws of a body.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "runtime/background/surface_frames.h"
#include "runtime/body/body.h"
#include "runtime/body/patch.h"
#include "runtime/scene/inner_surface.h"

namespace palpate {

/// In space the surface as the elements have it; in the plane all elements, where their displacement is known
/// (all free nodes are stored), else the boundary.
struct Scene {
  std::uint32_t number = 0;  ///< from 1 on
  int dimension = 3;
  bool is_plane = false;             ///< nodes are all mesh nodes, not those of the surface
  std::vector<Index> surface_nodes;  ///< in that case the body's on the surface; else empty: the first are
  std::vector<Vec3> nodes;           ///< [S] without loads [m]
  std::vector<std::array<Index, 3>> triangles;  ///< [T]
  std::vector<Index> elements;                  ///< [T] that each is on; in a recording unknown: empty
  std::vector<std::array<Index, 2>> edges;      ///< of the elements, each once
  std::vector<std::uint8_t> held;               ///< [S] as Model::fixed
  std::vector<std::uint8_t> materials;          ///< [T] in space, where there are several; else empty
  InnerSurface inner;
  std::vector<Index> order;  ///< [S] of the nodes in messages: neighbours follow each other
};

/// The finer surface of an overlay, in place of some of a scene's triangles.
struct ScenePatch {
  std::uint32_t number = 0;                     ///< from 1 on, by who shows it
  std::vector<Index> surface_nodes;             ///< [m] of Body::simplices, that its own nodes are
  std::vector<Index> hidden;                    ///< triangles of the scene
  std::vector<Vec3> nodes;                      ///< [m] without loads [m]
  std::vector<std::array<Index, 3>> triangles;  ///< of its own nodes
  std::vector<std::array<Index, 2>> outline;    ///< in the plane: the boundary
  std::vector<std::uint8_t> materials;          ///< [t] as a scene's
};

/// The scene of a body. Throws Error when the model's surface is not that of its mesh.
Scene make_scene(const Body& body, std::uint32_t number);

/// The scene of a body in the plane, all of whose elements are drawn, of which nothing but the mesh is there.
Scene make_plane_scene(const Model& model, std::uint32_t number);

/// The scene of an overlay on the body of `scene`. Its number is left 0.
ScenePatch make_scene_patch(const Body& body, const Scene& scene, const Patch& patch);

/// Whether a picture has values for all nodes of the scene and of the patch (null: none).
bool fits(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch);

/// The scene of a recording: all of its surface with the edges of its triangles.
Scene make_scene(const RecordedSurface& surface, std::uint32_t number);

}  // namespace palpate
