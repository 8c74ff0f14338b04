// Solver for the tangent, by its factor or by conjugate gradients.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "matrices/sparse_cholesky.h"
#include "statics/solver_kind.h"
#include "statics/tangent_pattern.h"

namespace palpate {

struct TangentSolverOptions {
  SolverKind kind = SolverKind::factor;
  double tolerance = 1e-8;   ///< conjugate gradients: |A x - b|, relative to |b|
  int most_iterations = 12;  ///< conjugate gradients: after more the preconditioner is renewed
};

/// A^-1 for symmetric positive definite matrices of one pattern, one after the other.
class TangentSolver {
 public:
  explicit TangentSolver(const TangentSolverOptions& options) : options_(options) {}

  /// Sets A to this matrix (its lower triangle), which must outlive its use. Returns false if it is not
  /// positive definite or not finite.
  bool set(const LiveMatrix& A);

  /// x = A^-1 b. Returns false if conjugate gradients do not converge.
  bool solve(const Eigen::VectorXd& b, Eigen::VectorXd& x);

  /// Solves with the present factor, which may be that of an older matrix if the solver is conjugate
  /// gradients.
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
