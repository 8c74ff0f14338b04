// Solves more accurate than double precision, as reference for stored numbers.
#pragma once

#include <Eigen/Dense>

#include "precompute/numerics/factor.h"

namespace palpate {

/// x = K^-1 b, by the factor alone and refined.
struct RefinedSolution {
  using Refined = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  Eigen::MatrixXd plain;  ///< [n, columns] by Factor::solve
  Refined refined;        ///< [n, columns] with residuals in extended precision: its error does not depend on
                          ///< the condition of K up to about 1e15
};

/// Solves for the columns of b [n, columns]. `factor`: of K, computed; K: the lower triangle.
RefinedSolution solve_refined(const Factor& factor, const SparseMatrix& K, const Eigen::MatrixXd& b);

/// A^-1 b of a dense matrix [n x n] whose factor in double precision is given, refined.
RefinedSolution::Refined solve_refined(const Eigen::LLT<Eigen::MatrixXd>& factor,
                                       const RefinedSolution::Refined& A, const Eigen::MatrixXd& b);

/// Solves without refinement: both members by the factor alone.
RefinedSolution solve_plain(const Factor& factor, const Eigen::MatrixXd& b);

}  // namespace palpate
