// A contact problem of many points whose compliance is known.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "runtime/core/solve/contact_problem.h"

namespace palpate::test {

/// A ball on a smooth compliance, on a grid of side x side points one apart, as the tick states it: the
/// normal is x in a point's frame, which `turned` turns at random.
struct Grid {
  Grid(int side, double mu, double depth, double slide, bool turned, double apart = 1.0)
      : problem(3, side * side, 0, 3 * side * side), rows(mu > 0.0 ? 3 : 1) {
    const double middle = 0.5 * (side - 1) + 0.1;
    for (int k = 0; k < side * side; ++k) {
      const int row = k / side;
      points.emplace_back(apart * (k % side - middle), apart * (row - middle), 0.0);
    }
    std::mt19937 random(5);
    std::normal_distribution<double> entry;
    problem.clear(true);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Eigen::Quaterniond turn(entry(random), entry(random), entry(random), entry(random));
      frames.push_back(turned && rows == 3 ? turn.normalized().toRotationMatrix()
                                           : Eigen::Matrix3d::Identity());
      problem.add(mu, false, frames.back().col(0));
    }
    fill(depth, slide);
  }

  void fill(double depth, double slide) {
    W.resize(problem.rows, problem.rows);
    b.resize(problem.rows);
    const Eigen::Vector3d give(1.0, 0.8, 0.7);
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (std::size_t j = 0; j < points.size(); ++j) {
        const Eigen::Matrix3d w =
            1e-3 * ((i == j ? 0.2 : 0.0) + 1.0 / std::sqrt(1.0 + (points[i] - points[j]).squaredNorm())) *
            (frames[i] * give.asDiagonal() * frames[j].transpose());
        for (int p = 0; p < rows; ++p) {
          for (int q = 0; q < rows; ++q) W(at(i) + p, at(j) + q) = w(p, q);
        }
      }
      const double gap = 1e-3 * (points[i].squaredNorm() / 40.0 - depth);
      const Eigen::Vector3d moved = frames[i] * Eigen::Vector3d(gap, 1e-3 * slide, 2e-4 * slide);
      for (int p = 0; p < rows; ++p) b[at(i) + p] = moved[p];
    }
    for (Index i = 0; i < problem.rows; ++i) {
      for (Index j = 0; j < problem.rows; ++j) problem.single_row(i)[j] = static_cast<float>(W(i, j));
      problem.b[static_cast<std::size_t>(i)] = b[i];
    }
  }

  /// A tick begins: b is r by the forces of the one before.
  void begin() {
    const Eigen::VectorXd r = b + W * lambda();
    std::copy_n(r.data(), problem.rows, problem.b.begin());
    problem.base = problem.lambda;
  }

  [[nodiscard]] Eigen::Index at(std::size_t k) const { return static_cast<Eigen::Index>(k) * rows; }
  [[nodiscard]] Eigen::VectorXd lambda() const {
    return Eigen::Map<const Eigen::VectorXd>(problem.lambda.data(), problem.rows);
  }
  /// The sum of the forces in the points' own frames.
  [[nodiscard]] Eigen::Vector3d sum(const Eigen::VectorXd& of_rows) const {
    Eigen::Vector3d total = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < points.size(); ++k) {
      Eigen::Vector3d force = Eigen::Vector3d::Zero();
      for (int p = 0; p < rows; ++p) force[p] = of_rows[at(k) + p];
      total += frames[k].transpose() * force;
    }
    return total;
  }

  ContactProblem problem;
  int rows;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Matrix3d> frames;  // the tick's axes by the point's
  Eigen::MatrixXd W;
  Eigen::VectorXd b;
};

/// Gauss-Seidel sweeps of Alart & Curnier's projections in double precision over r = b + W lambda, until no
/// force moves by `tolerance` [N] in one, or `most` of them. What moved most in the last one [N].
inline double sweep_exactly(const Grid& grid, double mu, Eigen::VectorXd& lambda, int most,
                            double tolerance) {
  Eigen::VectorXd r = grid.b + grid.W * lambda;
  double moved = 0.0;
  for (int sweep = 0; sweep < most; ++sweep) {
    moved = 0.0;
    for (std::size_t k = 0; k < grid.points.size(); ++k) {
      const auto i = grid.at(k);
      const Eigen::Vector3d n = grid.frames[k].col(0);
      const double step = 0.9 / grid.W.block(i, i, grid.rows, grid.rows).diagonal().maxCoeff();
      Eigen::Vector3d z = Eigen::Vector3d::Zero();
      for (int p = 0; p < grid.rows; ++p) z[p] = lambda[i + p] - step * r[i + p];
      const double normal = std::max(0.0, grid.rows == 1 ? z[0] : n.dot(z));
      Eigen::Vector3d tangent = z - n.dot(z) * n;
      if (tangent.norm() > mu * normal) tangent *= mu * normal / tangent.norm();
      const Eigen::Vector3d to =
          grid.rows == 1 ? Eigen::Vector3d(normal, 0.0, 0.0) : Eigen::Vector3d(normal * n + tangent);
      Eigen::Vector3d change = Eigen::Vector3d::Zero();
      for (int p = 0; p < grid.rows; ++p) {
        change[p] = to[p] - lambda[i + p];
        lambda[i + p] = to[p];
        if (change[p] != 0.0) r += change[p] * grid.W.col(i + p);
      }
      moved = std::max(moved, change.norm());
    }
    if (moved < tolerance) break;
  }
  return moved;
}

}  // namespace palpate::test
