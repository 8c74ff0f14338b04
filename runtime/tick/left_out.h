// Where a tool may press on the surface, and there was no room for it.
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "meshes/mesh.h"

namespace palpate {

/// A contact point, or a simplex that was not looked at, by the node of the surface that is nearest to it.
struct LeftOut {
  Index tool = -1;
  Index node = -1;              ///< of the surface
  Vec3 normal = Vec3::Zero();   ///< out of the body
  Vec3 apart = Vec3::Zero();    ///< the tool's place less the node's when it was found [m]
  double gap = 0.0;             ///< then [m]
  double contact_points = 1.0;  ///< that it stands for: a vertex has two triangles or one line
};

/// Of those left out most that the size of the force's error is taken from: each is the same part of them.
inline constexpr std::size_t most_sampled = 256;

}  // namespace palpate
