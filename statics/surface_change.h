// How far a surface is from where it was: what small strain has to bear.
#pragma once

#include <span>

#include "meshes/mesh.h"

namespace palpate {

/// The largest rotation and the largest strain on a displaced surface.
struct SurfaceChange {
  double rotation = 0.0;  ///< by which a simplex has turned [rad]
  double strain = 0.0;    ///< principal strain within a simplex, stretch less 1, without its sign [-]
};

/// `simplices` [F d]: nodes of triangles, in the plane of lines; `rest` [S]: where the nodes are without it;
/// `u` [S]: displacement from there [m].
SurfaceChange surface_change(int dimension, std::span<const Index> simplices, std::span<const Vec3> rest,
                             std::span<const Vec3> u) noexcept;

}  // namespace palpate
