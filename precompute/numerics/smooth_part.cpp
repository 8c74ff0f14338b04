#include "precompute/numerics/smooth_part.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace palpate {
namespace {

using Matrix = Eigen::MatrixXd;

constexpr std::int64_t more_vectors = 8;  // extra vectors of the iteration
constexpr int iterations = 2;
constexpr double smallest = 1e-14;  // relative eigenvalue that exceeds rounding

/// X -> D^1/2 A D^1/2 X for the free stored dofs.
class ScaledInverse {
 public:
  ScaledInverse(const Factor& factor, const SparseMatrix& K, std::span<const std::int64_t> stored_dofs)
      : factor_(factor) {
    std::copy_if(stored_dofs.begin(), stored_dofs.end(), std::back_inserter(dofs_),
                 [](std::int64_t dof) { return dof >= 0; });
    root_.resize(std::ssize(dofs_));
    for (std::size_t i = 0; i < dofs_.size(); ++i)
      root_[static_cast<Eigen::Index>(i)] = std::sqrt(K.coeff(dofs_[i], dofs_[i]));
  }

  [[nodiscard]] Eigen::Index rows() const { return root_.size(); }
  [[nodiscard]] const Eigen::VectorXd& root() const { return root_; }  // root of D

  [[nodiscard]] Matrix operator*(const Matrix& X) const {
    Matrix b = Matrix::Zero(factor_.order(), X.cols());
    for (std::size_t i = 0; i < dofs_.size(); ++i)
      b.row(dofs_[i]) = root_[static_cast<Eigen::Index>(i)] * X.row(static_cast<Eigen::Index>(i));
    const std::vector<double> x = factor_.solve({b.data(), static_cast<std::size_t>(b.size())}, X.cols());
    const Eigen::Map<const Matrix> solved(x.data(), b.rows(), b.cols());
    Matrix Y(X.rows(), X.cols());
    for (std::size_t i = 0; i < dofs_.size(); ++i)
      Y.row(static_cast<Eigen::Index>(i)) = root_[static_cast<Eigen::Index>(i)] * solved.row(dofs_[i]);
    return Y;
  }

 private:
  const Factor& factor_;
  std::vector<std::int64_t> dofs_;
  Eigen::VectorXd root_;
};

Matrix orthonormal(const Matrix& X) {
  return Eigen::HouseholderQR<Matrix>(X).householderQ() * Matrix::Identity(X.rows(), X.cols());
}

}  // namespace

SmoothPart smooth_part(const Factor& factor, const SparseMatrix& K, std::span<const std::int64_t> stored_dofs,
                       std::int64_t terms) {
  const ScaledInverse A(factor, K, stored_dofs);
  const std::int64_t width = std::min(terms + more_vectors, A.rows());
  terms = std::min(terms, width);
  std::mt19937_64 random(17);
  Matrix X(A.rows(), width);
  for (Eigen::Index j = 0; j < X.cols(); ++j)
    for (Eigen::Index i = 0; i < X.rows(); ++i) X(i, j) = (random() & 1U) != 0 ? 1.0 : -1.0;
  for (int i = 0; i < iterations; ++i) X = orthonormal(A * orthonormal(X));

  // A is at least Y (X^T Y)^-1 Y^T, and equal to it on the span of X.
  const Matrix Y = A * X;
  const Matrix XtY = X.transpose() * Y;
  const Eigen::SelfAdjointEigenSolver<Matrix> solver((XtY + XtY.transpose()) / 2.0);
  const Eigen::VectorXd& values = solver.eigenvalues();  // ascending
  SmoothPart smooth{.terms = terms, .rows = {}};
  Matrix W = Matrix::Zero(A.rows(), terms);
  for (std::int64_t k = 0; k < terms; ++k) {
    const Eigen::Index from = width - 1 - k;
    if (values[from] > smallest * values[width - 1])
      W.col(k) = (Y * solver.eigenvectors().col(from)).cwiseQuotient(A.root()) / std::sqrt(values[from]);
  }
  smooth.rows.assign(stored_dofs.size() * static_cast<std::size_t>(terms), 0.0);
  Eigen::Index row = 0;
  for (std::size_t dof = 0; dof < stored_dofs.size(); ++dof) {
    if (stored_dofs[dof] < 0) continue;
    for (std::int64_t k = 0; k < terms; ++k)
      smooth.rows[dof * static_cast<std::size_t>(terms) + static_cast<std::size_t>(k)] = W(row, k);
    ++row;
  }
  return smooth;
}

SmoothPart first_terms(const SmoothPart& smooth, std::int64_t terms) {
  SmoothPart result{.terms = terms, .rows = {}};
  const std::int64_t n = std::ssize(smooth.rows) / smooth.terms;
  result.rows.reserve(static_cast<std::size_t>(n * terms));
  for (std::int64_t dof = 0; dof < n; ++dof)
    result.rows.insert(result.rows.end(), smooth.row(dof), smooth.row(dof) + terms);
  return result;
}

}  // namespace palpate
