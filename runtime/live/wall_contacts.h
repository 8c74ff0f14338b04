// Contact with walls in an implicit step: all nodes at once, through the inverse of the step's matrix.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "runtime/live/walls.h"
#include "runtime/solve/cone_solver.h"
#include "runtime/solve/contact_problem.h"
#include "statics/live_body.h"
#include "statics/tangent_solver.h"

namespace palpate {

/// Wall forces on a body within one step. Contacts are of free nodes (along every axis); each is solved for
/// with Coulomb's law on what it moves in the step: r = b + W lambda, W = J A^-1 J^T (runtime/solve).
class WallContacts {
 public:
  /// Room for `most` contacts; where there are more, the deepest.
  WallContacts(const LiveBody& body, std::vector<Wall> walls, Index most = 200);

  [[nodiscard]] bool any_walls() const noexcept { return !walls_.empty(); }
  [[nodiscard]] const std::vector<Wall>& walls() const noexcept { return walls_; }
  [[nodiscard]] Index count() const noexcept { return static_cast<Index>(contacts_.size()); }
  [[nodiscard]] Index closed() const noexcept;  ///< with a force

  /// Begins a step at positions x [d N]: no contacts.
  void begin(const Eigen::VectorXd& x) noexcept;

  /// Takes up nodes that are in a wall at positions x [d N]. True where there are new ones.
  bool find(const Eigen::VectorXd& x);

  /// Given x [d N] as it is by the forces so far, finds the forces with which it is to be, and moves x by
  /// what they change, dx = A^-1 J^T dlambda; again where nodes are in a wall then that were not before.
  /// `ahead`: x at the end of the step is as many times as far from its beginning as x is. False where the
  /// contact solver did not get there.
  bool solve(const TangentSolver& A, double ahead, Eigen::VectorXd& x);

  /// Adds the forces [d N] to f [N].
  void add_forces(Eigen::VectorXd& f) const noexcept;

  /// The normal and the friction of the contact of a node that has a force; for what follows a step.
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
  std::vector<Index> nodes_;  // that can touch
  Index most_;
  std::vector<Contact> contacts_;
  std::vector<bool> has_contact_;  // [nodes_ x walls]
  Eigen::VectorXd from_;           // [d N]
  ContactProblem problem_;
  ActiveSet active_set_;
  ConeSolver cone_solver_;
};

/// The part of x [d N] that is a node's [m].
inline Vec3 node_part(const Eigen::VectorXd& x, int d, Index node) noexcept {
  Vec3 part = Vec3::Zero();
  part.head(d) = x.segment(Eigen::Index{d} * node, d);
  return part;
}

}  // namespace palpate
