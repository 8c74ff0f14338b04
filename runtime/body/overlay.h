// s-FEM overlay of a patch: a finer mesh over some elements of the body (Fish 1992).
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

#include "overlay/patch_mesh.h"
#include "runtime/body/body.h"

namespace palpate {

/// Stiffness K_L and K_LG of a patch (theory.md section 4). With g = patch.nodes, local dofs are the free
/// ones, and dofs of the body are d k + axis for the k-th of patch.nodes; columns of dofs held along an axis
/// are zero.
struct PatchStiffness {
  Eigen::SparseMatrix<double> K_L;  ///< [L x L] symmetric, positive definite [N/m]
  Eigen::MatrixXd K_LG;             ///< [L x d g] integral of B_L^T D B_G [N/m]
};

/// Assembles both from the elements' own integrals: the body's shape functions are sums of the local ones, so
/// K_LG is the stiffness of the fine mesh times them.
PatchStiffness assemble_patch(const Model& model, const PatchMesh& patch);

/// Change of the body's Green's functions by an overlay, condensed onto the patch (theory.md section 4):
///   Xi_G = Xi + Xi_Q M Xi_Q^T,  M = (I - G Xi_QQ)^-1 G,  G = K_GL K_L^-1 K_LG,
/// for any refinement. Forces f on the body's nodes have the effect that they have on the finer body if M u_Q
/// is added at the patch's nodes, where u_Q is their displacement by f without the overlay.
class Overlay {
 public:
  /// Throws Error if a node of the patch is not stored.
  Overlay(const Body& body, PatchMesh patch);

  [[nodiscard]] const PatchMesh& patch() const noexcept { return patch_; }
  [[nodiscard]] std::span<const Index> stored_nodes() const noexcept { return stored_; }  ///< [g] Q
  [[nodiscard]] const Eigen::MatrixXd& correction() const noexcept { return M_; }  ///< [d g x d g] M [N/m]

  /// Adds the change by the overlay to a block row from Greens::gather.
  void add_to_blocks(const Body& body, Index row, std::span<const Index> columns,
                     std::span<double> blocks) const;

  /// Returns M Xi_Q f: forces [d g] on the patch's nodes that, together with the forces f [d m] on stored
  /// nodes, give the body its displacement with the overlay.
  [[nodiscard]] Eigen::VectorXd forces_beside(const Body& body, std::span<const Index> nodes,
                                              std::span<const double> f) const;

  /// Block of Xi_G at (row, column) of stored nodes [d, d] [m/N].
  [[nodiscard]] Eigen::MatrixXd block(const Body& body, Index row, Index column) const;

  /// u_L = -K_L^-1 K_LG u_G|Q: local displacement [L] for the displacement [d g] of the patch's nodes.
  [[nodiscard]] Eigen::VectorXd local_displacement(const Eigen::VectorXd& u_Q) const {
    return recover_ * u_Q;
  }

 private:
  [[nodiscard]] Eigen::MatrixXd columns(const Body& body, Index node) const;

  PatchMesh patch_;
  std::vector<Index> stored_;
  Eigen::MatrixXd M_;
  Eigen::MatrixXd recover_;
};

}  // namespace palpate
