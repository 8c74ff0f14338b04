// Contact of a few hundred points by dense algebra in double precision, beside the runtime's solvers.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace palpate::test {

/// r = b + W p at n contact points: relative motion r [m] of tool and surface by the forces p [N] on the
/// tool, along a normal and two tangents, or the normals alone. Asked for is r_n >= 0, p_n >= 0, r_n p_n = 0
/// and Coulomb's |p_t| <= mu p_n, where p_t is opposed to r_t if that is an equality and r_t = 0 if not.
///
/// Newton's method on the projected equations, factored anew in each step; projected Gauss-Seidel sweeps
/// where it does not gain.
class CoulombSolver {
 public:
  /// `rows` of each contact point: 3, or 1 without friction.
  explicit CoulombSolver(int rows) : d_(rows) {}

  Eigen::MatrixXd W;  ///< [d n, d n] symmetric, positive definite [m/N]
  Eigen::VectorXd b;  ///< [d n] [m]
  Eigen::VectorXd p;  ///< [d n] first guess, then answer [N]
  double friction = 0.0;

  /// Until a projected sweep would change no force by more than `tolerance` times the largest. Returns what
  /// it would change, in that measure.
  double solve(double tolerance);

  [[nodiscard]] int rows() const { return d_; }       ///< of a contact point
  [[nodiscard]] int steps() const { return steps_; }  ///< of Newton's method in the last call

 private:
  [[nodiscard]] Eigen::Index contacts() const { return b.size() / d_; }
  [[nodiscard]] Eigen::VectorXd projected(Eigen::Index contact, const Eigen::VectorXd& force,
                                          const Eigen::VectorXd& motion) const;
  [[nodiscard]] double residual(const Eigen::VectorXd& force) const;
  [[nodiscard]] Eigen::VectorXd newton_step() const;
  [[nodiscard]] Eigen::VectorXd without_friction(const std::vector<Eigen::Index>& closed) const;
  [[nodiscard]] Eigen::VectorXd with_friction(const std::vector<Eigen::Index>& closed,
                                              const Eigen::VectorXd& motion) const;
  void sweep(int times);

  int d_;
  int steps_ = 0;
};

}  // namespace palpate::test
