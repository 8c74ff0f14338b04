// Rotation and strain of a displaced surface, which limit small strain theory.
#pragma once

#include <span>

#include "meshes/mesh.h"

namespace palpate {

/// Largest rotation and largest strain on a displaced surface.
struct SurfaceChange {
  double rotation = 0.0;  ///< rotation of a simplex [rad]
  double strain = 0.0;    ///< largest |stretch - 1| within a simplex [-]
};

/// `simplices` [F d]: nodes of triangles, in the plane of lines; `rest` [S]: positions without the
/// displacement; `u` [S]: displacement from there [m].
SurfaceChange surface_change(int dimension, std::span<const Index> simplices, std::span<const Vec3> rest,
                             std::span<const Vec3> u) noexcept;

}  // namespace palpate
