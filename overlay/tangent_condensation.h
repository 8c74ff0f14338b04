// Condensation of a patch's fine mesh by the tangent of a nonlinear law.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

#include "overlay/patch_layers.h"

namespace palpate {

/// Condenses a patch as `condense` does, for any symmetric stiffness K of its local dofs, together with
/// forces f on the free ones (docs/overlays.md).
class TangentCondensation {
 public:
  /// `patch` must outlive this.
  TangentCondensation(const Model& model, const PatchMesh& patch);

  /// `K` [d local nodes x d local nodes]: its lower triangle. `f` [free local dofs]. Returns false if K_L is
  /// not positive definite: the members below are then not valid.
  [[nodiscard]] bool set(const Eigen::SparseMatrix<double>& K, const Eigen::VectorXd& f);

  /// N^T K N [d g x d g] [N/m]: the stiffness of the body's own nodes Q in the patch.
  [[nodiscard]] const Eigen::MatrixXd& body_stiffness() const noexcept { return K_GG_; }
  /// G = K_GL K_L^-1 K_LG [d g x d g] [N/m].
  [[nodiscard]] const Eigen::MatrixXd& softening() const noexcept { return G_; }
  /// K_GL K_L^-1 f [d g] [N].
  [[nodiscard]] const Eigen::VectorXd& forces_on_body() const noexcept { return forces_on_body_; }
  /// K_L^-1 (f - K_LG u_Q) [free local dofs] [m].
  [[nodiscard]] Eigen::VectorXd local_displacement(const Eigen::VectorXd& u_Q) const;
  /// Condensed patch with its surface; `by_forces` gets K_L^-1 f there [d m] [m].
  [[nodiscard]] CondensedPatch condensed(Eigen::VectorXd& by_forces) const;

  /// The body's shape functions by dofs, N [d local nodes x d g].
  [[nodiscard]] const Eigen::SparseMatrix<double, Eigen::RowMajor>& shape() const noexcept { return shape_; }

 private:
  const PatchMesh& patch_;
  Eigen::Index d_;
  std::vector<Index> surface_;
  PatchLayers layers_;
  Eigen::SparseMatrix<double, Eigen::RowMajor> shape_;
  LayeredStiffness K_;
  Eigen::MatrixXd K_GG_, G_;
  Eigen::VectorXd forces_on_body_;
};

}  // namespace palpate
