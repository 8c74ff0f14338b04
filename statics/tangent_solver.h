// Solves with the tangent: by its factor, or by conjugate gradients.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "matrices/sparse_cholesky.h"
#include "statics/solver_kind.h"
#include "statics/tangent_pattern.h"

namespace palpate {

struct TangentSolverOptions {
  SolverKind kind = SolverKind::factor;
  double tolerance = 1e-8;   ///< conjugate gradients: |A x - b|, of |b|
  int most_iterations = 12;  ///< conjugate gradients: after more the preconditioner is made anew
};

/// A^-1 for symmetric positive definite matrices of one pattern, one after the other.
class TangentSolver {
 public:
  explicit TangentSolver(const TangentSolverOptions& options) : options_(options) {}

  /// From now on A is this matrix (its lower triangle), which must live on. False when it is not positive
  /// definite or not finite.
  bool set(const LiveMatrix& A);

  /// x = A^-1 b. False when conjugate gradients do not get there.
  bool solve(const Eigen::VectorXd& b, Eigen::VectorXd& x);

  /// Solves with the factor at hand, which by conjugate gradients may be of an older matrix.
  [[nodiscard]] Eigen::MatrixXd by_factor(const Eigen::MatrixXd& b) const { return factor_.solve(b); }

  [[nodiscard]] std::int64_t factorisations() const noexcept { return factorisations_; }
  [[nodiscard]] std::int64_t iterations() const noexcept { return iterations_; }  ///< of conjugate gradients

 private:
  bool factorise();

  TangentSolverOptions options_;
  const LiveMatrix* A_ = nullptr;
  SparseCholesky factor_;
  bool is_analysed_ = false;
  bool is_factorised_ = false;
  std::int64_t factorisations_ = 0;
  std::int64_t iterations_ = 0;
};

}  // namespace palpate
