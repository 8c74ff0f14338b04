// Static condensation of a patch's fine mesh onto the body's nodes and its own surface.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

#include "formats/condensed_patch.h"
#include "matrices/sparse_cholesky.h"
#include "overlay/patch_mesh.h"

namespace palpate {

/// Memory to condense in, for one Condensation after the other.
struct CondensationMemory {
  SparseCholesky factor;
  std::vector<Eigen::Triplet<double>> entries;
};

/// Condenses any symmetric stiffness K of a patch's fine mesh, with forces f on its free dofs. Dofs that are
/// not free follow the body's nodes Q by its shape functions N, u = N u_Q. Free dofs below the surface are
/// eliminated by a sparse factor, then those on it by a dense one (Guyan 1965).
class Condensation {
 public:
  /// `patch` and `memory` must outlive this.
  Condensation(const Model& model, const PatchMesh& patch, CondensationMemory& memory);

  /// Sets K to zero. Each K has entries at the same places.
  void clear();
  /// Adds to an entry of the lower triangle of K [d local nodes x d local nodes].
  void add(Eigen::Index row, Eigen::Index column, double value);
  /// `f` [free local dofs]. Returns false if K is not positive definite: what follows is then not valid.
  [[nodiscard]] bool factorise(const Eigen::VectorXd& f);

  /// Stiffness [d g x d g] of the fine mesh at the body's nodes Q [N/m].
  [[nodiscard]] const Eigen::MatrixXd& stiffness() const noexcept { return stiffness_; }
  /// K_GL K_L^-1 f [d g] [N].
  [[nodiscard]] const Eigen::VectorXd& forces_on_body() const noexcept { return forces_on_body_; }
  /// u_L = K_L^-1 (f - K_LG u_Q) [free local dofs] [m]: what the fine mesh adds to N u_Q.
  [[nodiscard]] Eigen::VectorXd local_displacement(const Eigen::VectorXd& u_Q) const;
  /// The condensed patch in place of elements with the stiffness K_P [d g x d g]: G = K_P - stiffness().
  [[nodiscard]] CondensedPatch condensed(const Eigen::MatrixXd& K_P) const;
  /// K_L^-1 f on the surface [d m] [m].
  [[nodiscard]] Eigen::VectorXd by_forces() const;

  /// The body's shape functions by dofs, N [d local nodes x d g].
  [[nodiscard]] const Eigen::SparseMatrix<double, Eigen::RowMajor>& shape() const noexcept { return shape_; }

 private:
  [[nodiscard]] Eigen::Index surface_dof(Eigen::Index dof) const;

  const PatchMesh& patch_;
  CondensationMemory& memory_;
  Eigen::Index d_;
  std::vector<Index> surface_;
  Eigen::SparseMatrix<double, Eigen::RowMajor> shape_;
  // Unknowns: free dofs below the surface, those on it, those of Q, and one for f.
  std::vector<int> unknown_;  // [d local nodes] of free dofs, else -1
  Eigen::Index below_ = 0, on_surface_ = 0;
  bool is_analysed_ = false;
  Eigen::MatrixXd bound_;    // [d g x d g] what K has between dofs that are not free
  Eigen::MatrixXd factor_;   // L of the stiffness at the surface, the rest condensed
  Eigen::MatrixXd columns_;  // L^-1 of its coupling to Q and of the forces
  Eigen::MatrixXd stiffness_;
  Eigen::VectorXd forces_on_body_, f_;
};

/// Condenses a patch of a linear body. Throws Error if its stiffness is not positive definite.
CondensedPatch condense(const Model& model, const PatchMesh& patch, CondensationMemory& memory);
CondensedPatch condense(const Model& model, const PatchMesh& patch);

}  // namespace palpate
