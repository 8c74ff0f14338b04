#include "statics/tangent_solver.h"

#include <cmath>

namespace palpate {

bool TangentSolver::set(const LiveMatrix& A) {
  A_ = &A;
  if (options_.kind == SolverKind::conjugate_gradient && is_factorised_) return true;
  return factorise();
}

bool TangentSolver::factorise() {
  if (!is_analysed_) factor_.analyse(*A_);
  is_analysed_ = true;
  ++factorisations_;
  is_factorised_ = factor_.factorise(*A_);
  return is_factorised_;
}

bool TangentSolver::solve(const Eigen::VectorXd& b, Eigen::VectorXd& x) {
  if (options_.kind == SolverKind::factor) {
    x = factor_.solve(b);
    return x.allFinite();
  }
  const auto A = A_->selfadjointView<Eigen::Lower>();
  const double enough = options_.tolerance * b.norm();
  x.setZero(b.size());
  Eigen::VectorXd r = b, z = factor_.solve(r), p = z, Ap;
  double rz = r.dot(z);
  for (int k = 0; k < 10 * options_.most_iterations; ++k) {
    if (r.norm() <= enough) return x.allFinite();
    if (k == options_.most_iterations) {  // the preconditioner is too old
      if (!factorise()) return false;
      x = factor_.solve(b);
      return x.allFinite();
    }
    ++iterations_;
    Ap = A * p;
    const double curvature = p.dot(Ap);
    if (!(curvature > 0.0)) return false;
    const double step = rz / curvature;
    x += step * p;
    r -= step * Ap;
    z = factor_.solve(r);
    const double next = r.dot(z);
    p = z + next / rz * p;
    rz = next;
  }
  return false;
}

}  // namespace palpate
