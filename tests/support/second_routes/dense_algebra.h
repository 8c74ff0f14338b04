// Dense decompositions that many tests ask for, compiled once: Eigen's take seconds to compile.
#pragma once

#include <Eigen/Core>

namespace palpate::test {

/// Of a symmetric matrix, ascending.
Eigen::VectorXd eigenvalues_of(const Eigen::MatrixXd& A);

/// The lambda of A x = lambda B x, ascending; A symmetric, B symmetric positive definite.
Eigen::VectorXd eigenvalues_of(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

/// Solutions of A x = lambda B x; A symmetric, B symmetric positive definite.
struct Eigenpairs {
  Eigen::VectorXd values;   ///< [n] ascending
  Eigen::MatrixXd vectors;  ///< [n, n] columns x with x^T B x = 1
};
Eigenpairs eigenpairs_of(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
Eigenpairs eigenpairs_of(const Eigen::MatrixXd& A);  ///< with B = 1

/// A^-1 of a symmetric positive definite matrix.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& A);

/// A^-1 b of a symmetric positive definite matrix.
Eigen::VectorXd solved(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

}  // namespace palpate::test
