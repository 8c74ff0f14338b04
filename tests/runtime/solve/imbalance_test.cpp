// What forces of a solver that was cut short are said to lack, against what they do lack.
#include "runtime/core/solve/imbalance.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "runtime/core/solve/active_set.h"
#include "runtime/core/solve/cone_solver.h"
#include "runtime/core/solve/newton_krylov.h"
#include "runtime/core/solve/tick_tuning.h"
#include "tests/support/second_routes/contact_grid.h"

namespace palpate::imbalance_test {
namespace {

using test::Grid;

/// The motions of all points by a motion of the tool along the points' axis: [rows].
Eigen::VectorXd tool_motion(const Grid& grid, int axis) {
  Eigen::VectorXd motion(grid.problem.rows);
  for (std::size_t k = 0; k < grid.points.size(); ++k) {
    for (int i = 0; i < grid.rows; ++i) motion[grid.at(k) + i] = grid.frames[k](i, axis);
  }
  return motion;
}

Eigen::VectorXd vector_of(std::span<const double> of_rows, Index rows) {
  return Eigen::Map<const Eigen::VectorXd>(of_rows.data(), rows);
}

/// What the grid's forces lack in sum, by an imbalance and `answers` [rows x 3].
Eigen::Vector3d missing(const Grid& grid, const ContactProblem& problem, const Eigen::MatrixXd& answers) {
  Imbalance imbalance(problem.contacts, problem.rows);
  imbalance.find(problem);
  return grid.sum(vector_of(imbalance.change(), problem.rows)) +
         answers.transpose() * vector_of(imbalance.motion(), problem.rows);
}

/// The same problem for the solvers of few contacts, in the points' own frames, whose first axis is the
/// normal.
ContactProblem few_of(const Grid& grid, double mu) {
  ContactProblem few(3, static_cast<Index>(grid.points.size()), grid.problem.rows);
  for (std::size_t k = 0; k < grid.points.size(); ++k) few.add(mu, false);
  for (Index i = 0; i < few.rows; ++i) {
    for (Index j = 0; j < few.rows; ++j) few.w(i, j) = grid.W(i, j);
    few.b[static_cast<std::size_t>(i)] = grid.b[i];
  }
  return few;
}

TEST(Imbalance, ResidualOfOneContactByItsFormula) {
  // Pressed 0.5 mm deep without force, then with twice the force that it takes.
  ContactProblem one(3, 1, 3);
  one.add(0.0, false);
  one.w(0, 0) = 2e-3;
  one.b[0] = -5e-4;
  Imbalance imbalance(1, 3);
  imbalance.find(one);
  EXPECT_DOUBLE_EQ(imbalance.residual(), 0.25);
  EXPECT_DOUBLE_EQ(imbalance.change()[0], 0.25);
  EXPECT_NEAR(imbalance.motion()[0], 0.0, 1e-18);
  one.lambda[0] = 0.5;
  imbalance.find(one);
  EXPECT_DOUBLE_EQ(imbalance.residual(), 0.25);
  EXPECT_DOUBLE_EQ(imbalance.change()[0], 0.0);
  EXPECT_DOUBLE_EQ(imbalance.motion()[0], 5e-4);
  one.b[0] = 2e-3;  // now it is to open
  imbalance.find(one);
  EXPECT_DOUBLE_EQ(imbalance.residual(), 0.5);
  EXPECT_DOUBLE_EQ(imbalance.change()[0], -0.5);
  EXPECT_DOUBLE_EQ(imbalance.motion()[0], 0.0);
}

TEST(Imbalance, ResidualOfAContactWhoseFrictionIsTooLarge) {
  ContactProblem one(3, 1, 3);
  one.add(0.5, false);
  for (Index i = 0; i < 3; ++i) one.w(i, i) = 1e-3;
  one.lambda = {2.0, 0.0, 3.0};
  one.b = {-2e-3, 0.0, -3e-3};  // r = 0, and 3 N are not within 0.5 times 2 N
  Imbalance imbalance(1, 3);
  imbalance.find(one);
  EXPECT_DOUBLE_EQ(imbalance.residual(), 2.0);
  EXPECT_DOUBLE_EQ(imbalance.change()[2], -2.0);
}

TEST(Imbalance, OfExactForcesIsNothing) {
  const Grid grid(10, 0.0, 1.0, 0.0, false);
  ContactProblem few = few_of(grid, 0.0);
  ASSERT_TRUE(ActiveSet(few.rows).solve(few));
  Imbalance imbalance(few.contacts, few.rows);
  imbalance.find(few);
  const Eigen::VectorXd lambda = vector_of(few.lambda, few.rows);
  EXPECT_GT(lambda.sum(), 0.0);
  EXPECT_LT(vector_of(imbalance.change(), few.rows).cwiseAbs().sum(), 1e-9 * lambda.sum());
  EXPECT_LT(vector_of(imbalance.motion(), few.rows).lpNorm<Eigen::Infinity>(), 1e-9 * grid.b.maxCoeff());
}

// While the same contacts stay closed, a step of Newton's method leaves nothing to be done.
TEST(Imbalance, IsWhatIsMissingWhereTheSameContactsAreClosed) {
  const Grid grid(10, 0.0, 1.0, 0.0, false);
  ContactProblem few = few_of(grid, 0.0);
  ActiveSet solver(few.rows);
  ASSERT_TRUE(solver.solve(few));
  const Eigen::VectorXd exact = vector_of(few.lambda, few.rows);
  Eigen::MatrixXd answers = Eigen::MatrixXd::Zero(few.rows, 3);
  const Eigen::VectorXd db = tool_motion(grid, 0);
  std::vector<double> answer(static_cast<std::size_t>(few.rows));
  solver.derivative(few, 1, {db.data(), static_cast<std::size_t>(few.rows)}, answer);
  answers.col(0) = vector_of(answer, few.rows);
  int closed = 0;
  for (Index i = 0; i < few.rows; ++i) {
    if (exact[i] == 0.0) continue;
    few.lambda[static_cast<std::size_t>(i)] *= closed++ % 2 == 0 ? 1.002 : 0.999;
  }
  const double truth = exact.sum() - vector_of(few.lambda, few.rows).sum();
  EXPECT_GT(closed, 20);
  EXPECT_GT(std::abs(truth), 1e-4 * exact.sum());
  EXPECT_NEAR(missing(grid, few, answers).x(), truth, 1e-6 * std::abs(truth));
}

struct Ratios {
  std::vector<double> of;  // what is said over what is so

  [[nodiscard]] double share(double low, double high) const {
    return static_cast<double>(
               std::count_if(of.begin(), of.end(), [&](double r) { return r >= low && r <= high; })) /
           static_cast<double>(of.size());
  }
  [[nodiscard]] double median() {
    std::sort(of.begin(), of.end());
    return of[of.size() / 2];
  }
};

// So many points that the budget is spent after some two rounds, from the forces of a tick that was 1 to 10 %
// of the depth away.
TEST(Imbalance, TellsHowFarASolverThatWasCutShortIsOff) {
  Ratios ratios;
  for (const int side : {17, 19, 21}) {
    for (const double mu : {0.1, 0.3, 0.6}) {
      const int room = side * side;
      NewtonKrylov solver(room, 3 * room);
      const auto settle = [&](double depth, int ticks) {
        Grid grid(side, mu, depth, 0.1, true, 0.5);
        for (int k = 0; k < ticks; ++k) {
          if (k > 0) grid.begin();
          static_cast<void>(solver.solve(grid.problem));
        }
        return grid;
      };
      const Grid rough = settle(0.6, 12);
      Eigen::VectorXd exact = rough.lambda();
      const double moved = test::sweep_exactly(rough, mu, exact, 300, 0.0);
      EXPECT_LT(moved, 1e-6 * exact.lpNorm<Eigen::Infinity>()) << side << ' ' << mu;
      for (const double from : {0.9, 0.97, 1.01, 1.03}) {
        const Grid before = settle(0.6 * from, 12);
        Grid cut(side, mu, 0.6, 0.1, true, 0.5);
        cut.problem.lambda = before.problem.lambda;
        cut.begin();
        if (solver.solve(cut.problem)) continue;
        Eigen::MatrixXd answers(cut.problem.rows, 3);
        const auto rows = static_cast<std::size_t>(cut.problem.rows);
        std::vector<double> db, answer(3 * rows);
        for (int axis = 0; axis < 3; ++axis) {
          const Eigen::VectorXd motion = tool_motion(cut, axis);
          db.insert(db.end(), motion.begin(), motion.end());
        }
        solver.derivative(cut.problem, 3, db, answer);
        for (int axis = 0; axis < 3; ++axis)
          answers.col(axis) =
              vector_of(std::span(answer).subspan(static_cast<std::size_t>(axis) * rows), cut.problem.rows);
        const double truth = (cut.sum(exact) - cut.sum(cut.lambda())).norm();
        ratios.of.push_back(missing(cut, cut.problem, answers).norm() / truth);
      }
    }
  }
  ASSERT_GT(ratios.of.size(), 20U);
  RecordProperty("cases", std::to_string(ratios.of.size()));
  RecordProperty("median", std::to_string(ratios.median()));
  EXPECT_GT(ratios.share(1.0 / 3.0, 3.0), 0.75);
  EXPECT_GT(ratios.share(1.0 / tuning.hand.error_margin, 100.0), 0.75) << "with its margin";
  EXPECT_NEAR(std::log(ratios.median()), 0.0, std::log(1.3));
}

// Forces of a tick before, where the ball was less deep: all but where the contact begins is a little wrong.
TEST(Imbalance, OfTheForcesOfAnotherDepthWithFewContacts) {
  for (const double mu : {0.1, 0.3, 0.6}) {
    for (const double from : {0.9, 0.99, 1.02}) {
      const auto solve = [&](double depth, ContactProblem& few, ConeSolver& solver) {
        Grid grid(5, mu, depth, 0.02, false);
        few = few_of(grid, mu);
        EXPECT_TRUE(solver.solve(few));
        return grid;
      };
      ContactProblem before(3, 25, 75), few(3, 25, 75);
      ConeSolver solver(25, 75);
      solve(0.1 * from, before, solver);
      const Grid grid = solve(0.1, few, solver);
      Eigen::MatrixXd answers(few.rows, 3);
      std::vector<double> answer(static_cast<std::size_t>(few.rows));
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::VectorXd db = tool_motion(grid, axis);
        solver.derivative(few, {db.data(), static_cast<std::size_t>(few.rows)}, answer);
        answers.col(axis) = vector_of(answer, few.rows);
      }
      const Eigen::Vector3d exact = grid.sum(vector_of(few.lambda, few.rows));
      few.lambda = before.lambda;
      const Eigen::Vector3d truth = exact - grid.sum(vector_of(few.lambda, few.rows));
      EXPECT_LT((missing(grid, few, answers) - truth).norm(), 0.5 * truth.norm()) << mu << ' ' << from;
    }
  }
}

}  // namespace
}  // namespace palpate::imbalance_test
