// Contact with walls in an implicit step: all nodes together, through the inverse of the step's matrix.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "runtime/core/solve/cone_solver.h"
#include "runtime/core/solve/contact_problem.h"
#include "runtime/live/walls.h"
#include "statics/live_body.h"
#include "statics/tangent_solver.h"

namespace palpate {

/// Wall forces on a body within one step. Contacts are with nodes that are free along every axis; Coulomb's
/// law is solved for their relative displacement in the step: r = b + W lambda, W = J A^-1 J^T
/// (runtime/solve).
class WallContacts {
 public:
  /// Capacity for `most` contacts; of more, the deepest are kept.
  WallContacts(const LiveBody& body, std::vector<Wall> walls, Index most = 200);

  [[nodiscard]] bool any_walls() const noexcept { return !walls_.empty(); }
  [[nodiscard]] Index count() const noexcept { return static_cast<Index>(contacts_.size()); }
  [[nodiscard]] Index closed() const noexcept;  ///< contacts with a force

  /// Begins a step at positions x [d N], without contacts.
  void begin(const Eigen::VectorXd& x) noexcept;

  /// Adds nodes that are inside a wall at positions x [d N]. True if there are new ones.
  bool find(const Eigen::VectorXd& x);

  /// Finds the wall forces for positions x [d N], which include the effect of the forces so far, and moves x
  /// by the effect of their change, dx = A^-1 J^T dlambda; repeats if further nodes are inside a wall then.
  /// `ahead`: (x at the end of the step - x at its beginning) / (x - x at its beginning). False if the
  /// contact solver did not converge.
  bool solve(const TangentSolver& A, double ahead, Eigen::VectorXd& x);

  /// Adds the forces [d N] to f [N].
  void add_forces(Eigen::VectorXd& f) const noexcept;

  /// Contact of a node with a force, for use after a step.
  struct Contact {
    Index node;
    const Wall* wall;
    Vec3 normal;
    Vec3 force = Vec3::Zero();  ///< on the node [N]
  };
  [[nodiscard]] const std::vector<Contact>& contacts() const noexcept { return contacts_; }

 private:
  bool solve_found(const TangentSolver& A, double ahead, Eigen::VectorXd& x);
  void gather(const Eigen::MatrixXd& moved_by, const Eigen::MatrixXd& J, double ahead,
              const Eigen::VectorXd& x);
  [[nodiscard]] Eigen::MatrixXd directions() const;

  const LiveBody& body_;
  std::vector<Wall> walls_;
  std::vector<Index> nodes_;  // nodes that can touch a wall
  Index most_;
  std::vector<Contact> contacts_;
  std::vector<bool> has_contact_;  // [nodes_ x walls]
  Eigen::VectorXd from_;           // [d N]
  ContactProblem problem_;
  ActiveSet active_set_;
  ConeSolver cone_solver_;
};

/// Part of x [d N] that belongs to a node [m].
inline Vec3 node_part(const Eigen::VectorXd& x, int d, Index node) noexcept {
  Vec3 part = Vec3::Zero();
  part.head(d) = x.segment(Eigen::Index{d} * node, d);
  return part;
}

}  // namespace palpate
