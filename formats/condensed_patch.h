// What geometry and material alone tell of an overlay patch.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// A patch's fine mesh, condensed (theory.md section 4), with d dofs a node and g nodes of the body. Forces f
/// on the surface's nodes and the displacement u_Q of the body's give the surface
///   u = T u_Q + K_L^-1 f,   T = shape - K_L^-1 K_LG,
/// and act on the body as T^T f; the fine mesh softens the body by G.
struct CondensedPatch {
  std::vector<Index> surface;  ///< [m] local nodes on the body's surface, ascending
  Eigen::MatrixXd G;           ///< [d g x d g] K_GL K_L^-1 K_LG [N/m]
  Eigen::MatrixXd T;           ///< [d m x d g]
  Eigen::MatrixXd compliance;  ///< [d m x d m] K_L^-1 there [m/N], zero where u_L = 0
};

}  // namespace palpate
