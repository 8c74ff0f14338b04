#include "precompute/numerics/refined_solve.h"

#include <vector>

namespace palpate {
namespace {

using Refined = RefinedSolution::Refined;

constexpr int most_steps = 6;
constexpr long double fine = 1e-18L;  // remaining relative error

Eigen::MatrixXd solve(const Factor& factor, const Eigen::MatrixXd& b) {
  const std::vector<double> x = factor.solve({b.data(), static_cast<std::size_t>(b.size())}, b.cols());
  return Eigen::Map<const Eigen::MatrixXd>(x.data(), b.rows(), b.cols());
}

Eigen::MatrixXd residual(const SparseMatrix& K, const Eigen::MatrixXd& b, const Refined& x) {
  Refined r = b.cast<long double>();
  for (Eigen::Index column = 0; column < x.cols(); ++column) {
    const long double* from = x.col(column).data();
    long double* to = r.col(column).data();
    for (std::int64_t j = 0; j < K.cols(); ++j) {
      long double sum = 0.0L;
      for (SparseMatrix::InnerIterator entry(K, j); entry; ++entry) {
        const long double value = entry.value();
        sum += value * from[entry.row()];
        if (entry.row() != j) to[entry.row()] -= value * from[j];
      }
      to[j] -= sum;
    }
  }
  return r.cast<double>();
}

/// Adds corrections by `solve` from the residual of x as long as they decrease.
template <class Solve, class Residual>
void refine(Refined& x, const Solve& solve, const Residual& residual_of) {
  const long double largest = x.cwiseAbs().maxCoeff();
  long double before = largest;
  for (int step = 0; step < most_steps; ++step) {
    const Eigen::MatrixXd change = solve(residual_of(x));
    const long double size = change.cwiseAbs().maxCoeff();
    if (!(size < before)) break;  // no further improvement
    x += change.cast<long double>();
    if (size * size <= fine * before * largest) break;  // the next change would be smaller by the same factor
    before = size;
  }
}

}  // namespace

RefinedSolution solve_plain(const Factor& factor, const Eigen::MatrixXd& b) {
  RefinedSolution solution{.plain = solve(factor, b), .refined = {}};
  solution.refined = solution.plain.cast<long double>();
  return solution;
}

RefinedSolution solve_refined(const Factor& factor, const SparseMatrix& K, const Eigen::MatrixXd& b) {
  RefinedSolution solution = solve_plain(factor, b);
  refine(
      solution.refined, [&](const Eigen::MatrixXd& r) { return solve(factor, r); },
      [&](const Refined& x) { return residual(K, b, x); });
  return solution;
}

Refined solve_refined(const Eigen::LLT<Eigen::MatrixXd>& factor, const Refined& A, const Eigen::MatrixXd& b) {
  Refined x = factor.solve(b).cast<long double>();
  refine(
      x, [&](const Eigen::MatrixXd& r) -> Eigen::MatrixXd { return factor.solve(r); },
      [&](const Refined& y) -> Eigen::MatrixXd { return (b.cast<long double>() - A * y).cast<double>(); });
  return x;
}

}  // namespace palpate
