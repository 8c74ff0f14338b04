// The solver for many contacts, against a slow one in double precision and against the active set.
#include "runtime/core/solve/newton_krylov.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "runtime/core/solve/active_set.h"
#include "runtime/core/solve/contact_problem.h"
#include "runtime/core/solve/tick_tuning.h"
#include "tests/support/second_routes/contact_grid.h"

namespace palpate::newton_krylov_test {
namespace {

using test::Grid;

/// Forces by sweeps in double precision until nothing moves.
Eigen::VectorXd by_sweeps(const Grid& grid, double mu, Eigen::VectorXd lambda) {
  EXPECT_LT(test::sweep_exactly(grid, mu, lambda, 20000, 1e-12), 1e-12) << "the reference did not converge";
  return lambda;
}

void expect_in_cones(const Grid& grid, double mu) {
  for (std::size_t k = 0; k < grid.points.size(); ++k) {
    const Eigen::Vector3d force = grid.lambda().segment<3>(grid.at(k));
    const Eigen::Vector3d n = grid.frames[k].col(0);
    const double normal = n.dot(force);
    EXPECT_GE(normal, -1e-6) << k;
    EXPECT_LE((force - normal * n).norm(), mu * normal + 1e-5) << k;
  }
}

class Friction : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Coefficients, Friction, testing::Values(0.1, 0.3, 0.6));

TEST_P(Friction, OfAHundredPointsIsThatOfSweepsInDoublePrecision) {
  for (const bool turned : {false, true}) {
    Grid grid(10, GetParam(), 0.6, 0.1, turned);
    NewtonKrylov solver(100, 300);
    ASSERT_TRUE(solver.solve(grid.problem));
    expect_in_cones(grid, GetParam());
    const Eigen::VectorXd exact = by_sweeps(grid, GetParam(), grid.lambda());
    const Eigen::Vector3d total = grid.sum(exact);
    EXPECT_GT(std::hypot(total.y(), total.z()), 0.02 * total.x()) << "the ball slides, so friction is felt";
    EXPECT_LT((grid.sum(grid.lambda()) - total).norm(), 1e-4 * total.norm());
    // What is left is rough, where W gives way fifty times less than a point alone.
    EXPECT_LT((grid.lambda() - exact).lpNorm<Eigen::Infinity>(),
              50.0 * tuning.many.rough_tolerance * exact.lpNorm<Eigen::Infinity>());
  }
}

TEST(NewtonKrylov, WithoutFrictionItIsTheActiveSet) {
  Grid grid(14, 0.0, 2.0, 0.0, false);
  NewtonKrylov solver(196, 196);
  ASSERT_TRUE(solver.solve(grid.problem));
  ContactProblem whole(3, 196, 196);
  for (Index k = 0; k < 196; ++k) whole.add(0.0, false);
  for (Index i = 0; i < 196; ++i) {
    for (Index j = 0; j < 196; ++j) whole.w(i, j) = grid.W(i, j);
    whole.b[static_cast<std::size_t>(i)] = grid.b[i];
  }
  ActiveSet active_set(196);
  ASSERT_TRUE(active_set.solve(whole));
  const Eigen::Map<const Eigen::VectorXd> exact(whole.lambda.data(), 196);
  EXPECT_GT((exact.array() > 0.0).count(), 40);
  EXPECT_NEAR(grid.lambda().sum(), exact.sum(), 1e-5 * exact.sum());
  EXPECT_LT((grid.lambda() - exact).lpNorm<Eigen::Infinity>(), 1e-3 * exact.maxCoeff());
}

// A tool at rest: the force is constant to 1e-9.
TEST(NewtonKrylov, ASolutionStaysAsItIs) {
  Grid grid(10, 0.3, 0.6, 0.1, true);
  NewtonKrylov solver(100, 300);
  const auto tick = [&] {
    grid.begin();
    return solver.solve(grid.problem);
  };
  for (int k = 0; k < 20; ++k) ASSERT_TRUE(tick());
  const Eigen::Vector3d before = grid.sum(grid.lambda());
  for (int k = 0; k < 100; ++k) {
    ASSERT_TRUE(tick());
    ASSERT_LT((grid.sum(grid.lambda()) - before).norm(), 1e-9 * before.norm()) << k;
  }
}

/// Rounds of a tick of 588 rows whose guess is off by 5e-4 of the largest force, and what is left.
std::pair<int, double> off_by_little(bool moves) {
  Grid grid(14, 0.3, 2.0, 0.3, true);
  NewtonKrylov solver(196, 588);
  for (int k = 0; k < 20; ++k) {
    grid.begin();
    solver.solve(grid.problem);
  }
  EXPECT_LT(solver.residual(), 1e-6);
  for (Index i = 0; i < grid.problem.rows; ++i)
    grid.problem.lambda[static_cast<std::size_t>(i)] *= 1.0 + 5e-4 * std::sin(0.5 * i);
  grid.begin();
  grid.problem.moves = moves;
  EXPECT_TRUE(solver.solve(grid.problem));
  return {solver.rounds(), solver.residual()};
}

// A step of Newton's method with so many rows is late: it is taken at rest, which has to be reached, and not
// while a tool moves.
TEST(NewtonKrylov, LateStepsAreTakenAtRest) {
  const auto [at_rest, left_at_rest] = off_by_little(false);
  const auto [moving, left_moving] = off_by_little(true);
  EXPECT_EQ(moving, 1) << "sweeps alone";
  EXPECT_GT(at_rest, 1);
  EXPECT_LT(left_at_rest, 0.5 * left_moving);
  EXPECT_LT(left_moving, tuning.many.late_tolerance);
}

// What is predicted of the forces' change is where it begins: a right prediction costs one product, a wrong
// one costs no more than that, and changes nothing.
TEST_P(Friction, BeginsWithThePredictionWhereThatIsNearer) {
  Grid grid(10, GetParam(), 0.6, 0.1, true);
  NewtonKrylov solver(100, 300);
  const auto solve_with = [&](const Eigen::VectorXd& prediction) {
    std::copy_n(grid.b.data(), grid.problem.rows, grid.problem.b.begin());
    std::fill(grid.problem.lambda.begin(), grid.problem.lambda.end(), 0.0);
    std::copy_n(prediction.data(), grid.problem.rows, grid.problem.prediction.begin());
    EXPECT_TRUE(solver.solve(grid.problem));
    return grid.lambda();
  };
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(grid.problem.rows);
  const Eigen::VectorXd without = solve_with(none);
  const int products = solver.products();
  EXPECT_GT(products, 8);
  const Eigen::VectorXd exact = by_sweeps(grid, GetParam(), without);

  EXPECT_LT((solve_with(exact) - exact).norm(), 1e-6 * exact.norm());
  EXPECT_EQ(solver.products(), 1);
  EXPECT_LT((solve_with(0.99 * exact) - exact).norm(), 1e-3 * exact.norm());
  EXPECT_LT(solver.products(), products);
  EXPECT_EQ(solve_with(-exact), without) << "is no force at all";
  EXPECT_EQ(solver.products(), products);
  EXPECT_EQ(solve_with(100.0 * exact), without);
  EXPECT_EQ(solver.products(), products + 1);
}

TEST_P(Friction, DerivativeIsThatOfFiniteDifferences) {
  Grid grid(8, GetParam(), 0.5, 0.05, true);
  NewtonKrylov solver(64, 192);
  for (int k = 0; k < 10; ++k) {
    grid.begin();
    ASSERT_TRUE(solver.solve(grid.problem));
  }
  const auto rows = static_cast<std::size_t>(grid.problem.rows);
  std::vector<double> db(3 * rows), dlambda(3 * rows);
  for (std::size_t k = 0; k < grid.points.size(); ++k) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t i = 0; i < 3; ++i)
        db[axis * rows + 3 * k + i] =
            grid.frames[k](static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(axis));
    }
  }
  solver.derivative(grid.problem, 3, db, dlambda);
  Eigen::Matrix3d told, measured;
  const Eigen::VectorXd now = by_sweeps(grid, GetParam(), grid.lambda());
  const double h = 1e-7;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Map<const Eigen::VectorXd> change(dlambda.data() + std::ptrdiff_t{axis} * grid.problem.rows,
                                                   grid.problem.rows);
    told.col(axis) = grid.sum(change);
    Grid moved = grid;
    moved.b += h * Eigen::Map<const Eigen::VectorXd>(db.data() + std::ptrdiff_t{axis} * grid.problem.rows,
                                                     grid.problem.rows);
    measured.col(axis) = grid.sum(by_sweeps(moved, GetParam(), now) - now) / h;
  }
  EXPECT_LT((told - measured).norm(), 0.02 * measured.norm()) << told << "\n\n" << measured;
}

// From a guess that is right already, and from one that is not, the derivative is no other.
TEST_P(Friction, DerivativeIsTheSameFromAnyGuess) {
  Grid grid(8, GetParam(), 0.5, 0.05, true);
  NewtonKrylov solver(64, 192);
  for (int k = 0; k < 10; ++k) {
    grid.begin();
    ASSERT_TRUE(solver.solve(grid.problem));
  }
  const Eigen::Index rows = grid.problem.rows;
  std::vector<double> db(static_cast<std::size_t>(3 * rows));
  for (Eigen::Index i = 0; i < 3 * rows; ++i) db[static_cast<std::size_t>(i)] = i / rows == i % 3 ? 1.0 : 0.0;
  Eigen::VectorXd without = Eigen::VectorXd::Zero(3 * rows);
  const auto derive = [&](Eigen::VectorXd from) {
    solver.derivative(grid.problem, 3, db, {from.data(), static_cast<std::size_t>(from.size())});
    return from;
  };
  without = derive(without);
  ASSERT_GT(without.norm(), 0.0);
  const auto is_derivative = [&](const Eigen::VectorXd& other) {
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d sum = grid.sum(without.segment(axis * rows, rows));
      EXPECT_LT((grid.sum(other.segment(axis * rows, rows)) - sum).norm(), 0.02 * sum.norm()) << axis;
    }
  };
  is_derivative(derive(without));
  is_derivative(derive(0.5 * without));
  std::mt19937 random(3);
  std::normal_distribution<double> entry;
  is_derivative(derive(Eigen::VectorXd::NullaryExpr(
      3 * rows, [&] { return entry(random) * without.norm() / std::sqrt(3.0 * grid.problem.rows); })));
}

// Points so near to each other that W is next to singular, and more friction than has an answer for sure:
// what comes is in the cones, whether the budget sufficed or not.
TEST(NewtonKrylov, WhatComesIsInTheCones) {
  Grid grid(12, 1.0, 0.02, 0.02, true, 0.05);
  NewtonKrylov solver(144, 432);
  for (int tick = 0; tick < 20; ++tick) {
    static_cast<void>(solver.solve(grid.problem));
    ASSERT_TRUE(grid.lambda().allFinite());
    expect_in_cones(grid, 1.0);
    grid.fill(0.02 + 1e-3 * tick, 0.02);
    grid.begin();
  }
}

// A grab, and rows that are there for a contact as long as it is closed.
TEST(NewtonKrylov, HeldRowsAreMetOrLeftOutWithTheirOwners) {
  Grid points(8, 0.3, 0.6, 0.1, false);
  ContactProblem problem(3, 74, 0, 3 * 64 + 10);
  problem.clear(true);
  for (Index k = 0; k < 64; ++k) problem.add(0.3, k == 27, Vec3::UnitX());
  for (Index k = 0; k < 10; ++k) problem.add_held_row(6 * k);
  std::mt19937 random(2);
  std::normal_distribution<double> entry;
  const Index n = 3 * 64;
  const Eigen::MatrixXd B =
      Eigen::MatrixXd::NullaryExpr(10, n, [&] { return 0.2 * entry(random) / std::sqrt(n); });
  Eigen::MatrixXd W(problem.rows, problem.rows);
  W << points.W, points.W * B.transpose(), B * points.W,
      B * points.W * B.transpose() + 1e-3 * Eigen::MatrixXd::Identity(10, 10);
  for (Index i = 0; i < problem.rows; ++i) {
    for (Index j = 0; j < problem.rows; ++j) problem.single_row(i)[j] = static_cast<float>(W(i, j));
    problem.b[static_cast<std::size_t>(i)] = i < n ? points.b[i] : 1e-4;
  }
  NewtonKrylov solver(74, problem.rows);
  const Eigen::VectorXd b = Eigen::Map<const Eigen::VectorXd>(problem.b.data(), problem.rows);
  const Eigen::Map<const Eigen::VectorXd> lambda(problem.lambda.data(), problem.rows);
  Eigen::VectorXd r = b;
  for (int k = 0; k < 10; ++k) {
    std::copy_n(r.data(), problem.rows, problem.b.begin());
    problem.base = problem.lambda;
    ASSERT_TRUE(solver.solve(problem));
    r = b + W * lambda;
  }
  const double length = 1e-4 * 1e-3 * lambda.lpNorm<Eigen::Infinity>();
  EXPECT_LT(r.segment<3>(Eigen::Index{3} * 27).norm(), length);
  int met = 0;
  for (Index k = 0; k < 10; ++k) {
    const bool is_open = lambda.segment<3>(Eigen::Index{18} * k).isZero(0.0);
    if (is_open) {
      EXPECT_EQ(lambda[n + k], 0.0);
    } else {
      EXPECT_LT(std::abs(r[n + k]), length);
    }
    met += is_open ? 0 : 1;
  }
  EXPECT_GT(met, 2);
  EXPECT_LT(met, 9);
}

}  // namespace
}  // namespace palpate::newton_krylov_test
