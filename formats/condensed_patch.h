// Part of an overlay patch that depends on geometry and material alone.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// A condensed fine mesh of a patch (theory.md section 4), with d dofs per node and g nodes of the body.
/// Forces f on the surface's nodes and the displacement u_Q of the body's nodes move the surface by
///   u = T u_Q + K_L^-1 f,   T = shape - K_L^-1 K_LG,
/// and act on the body as T^T f; G is how much softer the fine mesh makes the body.
struct CondensedPatch {
  std::vector<Index> surface;  ///< [m] local nodes on the body's surface, ascending
  Eigen::MatrixXd G;           ///< [d g x d g] K_GL K_L^-1 K_LG [N/m]
  Eigen::MatrixXd T;           ///< [d m x d g]
  Eigen::MatrixXd compliance;  ///< [d m x d m] K_L^-1 at those nodes [m/N], zero where u_L = 0
};

}  // namespace palpate
