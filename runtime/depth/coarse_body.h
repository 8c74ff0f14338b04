// The elastic energy of a body whose displacement is a coarse field.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "runtime/core/body/coarse_field.h"
#include "statics/live_body.h"

namespace palpate {

/// E(q) of a body at u = P q, a subspace of its mesh's displacements: mesh nodes follow the field, except
/// along axes on which they are held. A sum over parts of each cell, with the law at their mean deformation
/// gradient; what the gradient varies by within a part has the energy of small strain, turned with the part.
/// The tangent at rest is P^T K P (of tet4a with K of tet4, which is stiffer), and the cost does not depend
/// on the mesh.
class CoarseBody {
 public:
  /// `fine` must outlive it.
  CoarseBody(const LiveBody& fine, const CoarseField& field);

  [[nodiscard]] Eigen::Index dofs() const noexcept { return dofs_; }

  /// E(q) [J]; adds dE/dq [N] to `gradient` unless null.
  double energy(const Eigen::VectorXd& q, Eigen::VectorXd* gradient) const;
  /// d^2 E / dq^2 [N/m], without second derivatives of rotations.
  [[nodiscard]] Eigen::MatrixXd tangent(const Eigen::VectorXd& q) const;

 private:
  /// Part of a cell, of one material. A term is what a coarse node moves along some axes.
  struct Part {
    std::vector<Index> dofs;  // [3 terms] of the coarse field, all terms of an axis after those of the one
                              // before; -1: held, or not in the plane
    Index element = 0;        // one of those in it
    double volume = 0.0;      // [m^3]
    Eigen::MatrixX3d G;       // [terms x 3] mean gradients [1/m]
    std::vector<double> K;    // [3 terms x 3 terms] of small strain, by the gradients' variation [N/m]: the
                              // lower triangle, column by column
  };
  struct State;
  class Terms;

  void measure(Terms& of_body, const std::vector<Index>& points, Part& part) const;
  [[nodiscard]] State state(const Part& part, const Eigen::VectorXd& q) const;
  /// Adds a part's tangent [3 terms x 3 terms] to the blocks (i >= j) of the axes.
  void add_tangent(const Part& part, const Eigen::VectorXd& q, Eigen::MatrixXd& to) const;

  const LiveBody& fine_;
  Eigen::Index dofs_;
  std::vector<Part> parts_;
};

}  // namespace palpate
