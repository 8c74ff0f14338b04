#include "tests/support/second_routes/dense_algebra.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace palpate::test {

using Eigen::MatrixXd, Eigen::VectorXd;

VectorXd eigenvalues_of(const MatrixXd& A) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(A, Eigen::EigenvaluesOnly).eigenvalues();
}

VectorXd eigenvalues_of(const MatrixXd& A, const MatrixXd& B) {
  return Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd>(A, B, Eigen::EigenvaluesOnly).eigenvalues();
}

Eigenpairs eigenpairs_of(const MatrixXd& A, const MatrixXd& B) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(A, B);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigenpairs eigenpairs_of(const MatrixXd& A) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

MatrixXd inverse_of(const MatrixXd& A) {
  return A.llt().solve(MatrixXd::Identity(A.rows(), A.cols()));
}

VectorXd solved(const MatrixXd& A, const VectorXd& b) {
  return A.llt().solve(b);
}

}  // namespace palpate::test
