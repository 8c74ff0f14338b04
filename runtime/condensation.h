// A patch's fine mesh, condensed onto the body's nodes and its own surface.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "runtime/patch_mesh.h"

namespace palpate {

/// What geometry and material alone tell of a patch (theory.md section 4), with d dofs a node and g nodes of
/// the body. Forces f on the surface's nodes and the displacement u_Q of the body's give the surface
///   u = T u_Q + K_L^-1 f,   T = shape - K_L^-1 K_LG,
/// and act on the body as T^T f; the fine mesh softens the body by G.
struct CondensedPatch {
  std::vector<Index> surface;  ///< [m] local nodes on the body's surface, ascending
  Eigen::MatrixXd G;           ///< [d g x d g] K_GL K_L^-1 K_LG [N/m]
  Eigen::MatrixXd T;           ///< [d m x d g]
  Eigen::MatrixXd compliance;  ///< [d m x d m] K_L^-1 there [m/N], zero where u_L = 0
};

/// Eliminates the free local dofs layer by layer of nodes, from the deepest to the surface: a layer has
/// common elements with the next ones only. Throws Error when K_L is not positive definite.
CondensedPatch condense(const Model& model, const PatchMesh& patch);

}  // namespace palpate
