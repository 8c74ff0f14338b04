// The contact solvers against the conditions that define the answer, enumeration, and finite differences.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <random>
#include <vector>

#include "runtime/core/solve/active_set.h"
#include "runtime/core/solve/cone_solver.h"
#include "tests/support/second_routes/dense_algebra.h"

namespace palpate::solvers_test {
namespace {

struct Contact {
  double friction;
  bool held;
  Index owner = -1;  // of one held row
};

/// A problem with a random compliance of `rank` <= rows (+ a small diagonal, as the tick gives it) and random
/// b.
ContactProblem random_problem(int dimension, const std::vector<Contact>& contacts, unsigned seed,
                              Index rank = -1) {
  const Index room = static_cast<Index>(contacts.size()) + 2;
  ContactProblem problem(dimension, room, dimension * room);
  for (const Contact& contact : contacts) {
    if (contact.owner >= 0) {
      problem.add_held_row(contact.owner);
    } else {
      problem.add(contact.friction, contact.held);
    }
  }
  std::mt19937 random(seed);
  std::normal_distribution<double> entry;
  const Eigen::Index columns = rank < 0 ? problem.rows + 3 : rank;
  const Eigen::MatrixXd A =
      Eigen::MatrixXd::NullaryExpr(problem.rows, columns, [&] { return entry(random); });
  const Eigen::MatrixXd W = A * A.transpose() / static_cast<double>(columns);
  for (Index i = 0; i < problem.rows; ++i) {
    for (Index j = 0; j < problem.rows; ++j) problem.w(i, j) = 1e-3 * W(i, j) + (i == j ? 1e-13 : 0.0);
    problem.b[static_cast<std::size_t>(i)] = 1e-3 * (entry(random) - 0.3);
  }
  return problem;
}

Eigen::VectorXd motion(const ContactProblem& problem) {
  Eigen::VectorXd r(problem.rows);
  for (Index i = 0; i < problem.rows; ++i) {
    r[i] = problem.b[static_cast<std::size_t>(i)];
    for (Index j = 0; j < problem.rows; ++j)
      r[i] += problem.w(i, j) * problem.lambda[static_cast<std::size_t>(j)];
  }
  return r;
}

std::size_t at_contact(Index k) {
  return static_cast<std::size_t>(k);
}

/// Signorini's and Coulomb's conditions, to rounding: `length` [m] and `force` [N].
void expect_contact(const ContactProblem& problem, double length, double force) {
  const Eigen::VectorXd r = motion(problem);
  for (Index k = 0; k < problem.contacts; ++k) {
    const Index first = problem.first_row(k);
    const auto at = static_cast<std::size_t>(first);
    const Index count = problem.rows_of(k);
    if (problem.held[at_contact(k)] != 0) {
      const Index owner = problem.owner[at_contact(k)];
      const bool open = owner >= 0 && problem.lambda[at_contact(problem.first_row(owner))] == 0.0;
      if (open && problem.lambda[at] == 0.0) continue;  // left out with its owner
      EXPECT_LT(r.segment(first, count).norm(), length) << "held contact " << k;
      continue;
    }
    const double normal = problem.lambda[at];
    EXPECT_GE(normal, -force) << k;
    EXPECT_GE(r[first], -length) << k;
    EXPECT_TRUE(normal < force || r[first] < length) << k << ": force " << normal << " at gap " << r[first];
    if (count == 1) continue;
    const Eigen::Map<const Eigen::VectorXd> tangential(&problem.lambda[at + 1], count - 1);
    const Eigen::VectorXd slid = r.segment(first + 1, count - 1);
    const double bound = problem.friction[static_cast<std::size_t>(k)] * normal;
    EXPECT_LT(tangential.norm(), bound + force) << k;
    if (tangential.norm() < bound - force) {
      EXPECT_LT(slid.norm(), length) << k << " slides inside the cone";
    } else if (slid.norm() > length && bound > force) {
      EXPECT_NEAR(tangential.dot(slid), -bound * slid.norm(),
                  1e-6 * bound * slid.norm() + force * slid.norm())
          << k;
    }
  }
}

TEST(ActiveSet, FindsTheOneSetThatEnumerationFinds) {
  constexpr Index n = 9;
  for (unsigned seed = 0; seed < 200; ++seed) {
    ContactProblem problem = random_problem(3, std::vector<Contact>(n, {0.0, false}), seed);
    ActiveSet solver(40);
    ASSERT_TRUE(solver.solve(problem));
    Eigen::MatrixXd W(n, n);
    Eigen::VectorXd b(n);
    for (Index i = 0; i < n; ++i) {
      b[i] = problem.b[static_cast<std::size_t>(i)];
      for (Index j = 0; j < n; ++j) W(i, j) = problem.w(i, j);
    }
    int found = 0;
    for (unsigned set = 0; set < 1U << n; ++set) {
      std::vector<Index> in;
      for (Index i = 0; i < n; ++i) {
        if ((set >> i & 1U) != 0) in.push_back(i);
      }
      Eigen::VectorXd lambda = Eigen::VectorXd::Zero(n);
      const Eigen::VectorXd b_in = b(in);
      const Eigen::VectorXd closed = test::solved(W(in, in), -b_in);
      lambda(in) = closed;
      if (lambda.minCoeff() < 0.0 || (b + W * lambda).minCoeff() < -1e-15) continue;
      ++found;
      for (Index i = 0; i < n; ++i)
        EXPECT_NEAR(problem.lambda[static_cast<std::size_t>(i)], lambda[i], 1e-9 * lambda.maxCoeff());
    }
    EXPECT_EQ(found, 1) << seed;
  }
}

/// b = (1 m, -1 nm): the second contact is pressed by what is small beside the first one's gap, and is no
/// rounding.
TEST(ActiveSet, ASmallOverlapBesideALargeGapIsClosed) {
  ContactProblem problem(3, 2, 2);
  problem.add(0.0, false);
  problem.add(0.0, false);
  problem.w(0, 0) = problem.w(1, 1) = 1e-3;
  problem.w(0, 1) = problem.w(1, 0) = 0.0;
  problem.b[0] = 1.0;
  problem.b[1] = -1e-9;
  problem.lambda[0] = problem.lambda[1] = 0.0;
  ActiveSet solver(8);
  ASSERT_TRUE(solver.solve(problem));
  EXPECT_EQ(problem.lambda[0], 0.0);
  EXPECT_DOUBLE_EQ(problem.lambda[1], 1e-6);
}

TEST(ActiveSet, AnyGuessLeadsToTheSameForces) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> guess(-2.0, 2.0);
  for (unsigned seed = 0; seed < 50; ++seed) {
    std::vector<Contact> contacts(12, {0.0, false});
    contacts[3].held = contacts[7].held = true;
    ContactProblem cold = random_problem(3, contacts, seed);
    ContactProblem warm = cold;
    for (double& lambda : warm.lambda) lambda = guess(random);
    ActiveSet solver(64);
    ASSERT_TRUE(solver.solve(cold));
    expect_contact(cold, 1e-14, 1e-11);
    ASSERT_TRUE(solver.solve(warm));
    for (std::size_t i = 0; i < static_cast<std::size_t>(cold.rows); ++i)
      EXPECT_NEAR(warm.lambda[i], cold.lambda[i], 1e-8);
    ASSERT_TRUE(solver.solve(warm));
    EXPECT_EQ(solver.rounds(), 1) << "the solution is its own best guess";
  }
}

TEST(ActiveSet, ContactsThatCoincideAreSolvedToo) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    ContactProblem problem = random_problem(3, std::vector<Contact>(14, {0.0, false}), seed, 5);
    for (double& b : problem.b) b = -std::abs(b);
    for (Index i = 7; i < 14; ++i) {  // the same seven contacts again
      problem.b[static_cast<std::size_t>(i)] = problem.b[static_cast<std::size_t>(i - 7)];
      for (Index j = 0; j < 14; ++j) problem.w(i, j) = problem.w(i - 7, j);
      for (Index j = 0; j < 14; ++j) problem.w(j, i) = problem.w(j, i - 7);
    }
    for (Index i = 0; i < 14; ++i) problem.w(i, i) *= 1.0 + 1e-9;
    ActiveSet solver(42);
    EXPECT_TRUE(solver.solve(problem));
    expect_contact(problem, 1e-8, 1e-3);
  }
}

struct ConeCase {
  int dimension;
  int contacts;
  double friction;
};
class Cones : public testing::TestWithParam<ConeCase> {};
INSTANTIATE_TEST_SUITE_P(Cases, Cones,
                         testing::Values(ConeCase{3, 1, 0.5}, ConeCase{3, 4, 0.2}, ConeCase{3, 10, 0.5},
                                         ConeCase{3, 20, 0.3}, ConeCase{3, 10, 1.0}, ConeCase{2, 12, 0.4}));

TEST_P(Cones, MeetsSignoriniAndCoulomb) {
  int unsolved = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    std::vector<Contact> contacts(static_cast<std::size_t>(GetParam().contacts),
                                  {GetParam().friction, false});
    if (contacts.size() > 3) contacts[1] = {0.0, false};
    if (contacts.size() > 3 && seed % 2 == 0) contacts[2] = {0.0, true};
    ContactProblem problem = random_problem(GetParam().dimension, contacts, seed);
    ConeSolver solver(24, 72);
    if (!solver.solve(problem)) {
      ++unsolved;
      continue;
    }
    double largest_force = 0.0;
    double largest_compliance = 0.0;
    for (Index i = 0; i < problem.rows; ++i) {
      largest_force = std::max(largest_force, std::abs(problem.lambda[static_cast<std::size_t>(i)]));
      largest_compliance = std::max(largest_compliance, problem.w(i, i));
    }
    const double force = 1e-15 + 3.0 * tuning.cone.tolerance * largest_force;
    expect_contact(problem, force * largest_compliance, force);
  }
  EXPECT_LE(unsolved, GetParam().friction < 1.0 ? 0 : 2)
      << "with so much friction there need not be an answer";
}

TEST_P(Cones, TheSolutionIsItsOwnGuessSoNothingCreeps) {
  ContactProblem problem = random_problem(
      GetParam().dimension,
      std::vector<Contact>(static_cast<std::size_t>(GetParam().contacts), {GetParam().friction, false}), 3);
  ConeSolver solver(24, 72);
  for (int k = 0; k < 20; ++k) ASSERT_TRUE(solver.solve(problem));
  const std::vector<double> before = problem.lambda;
  for (int k = 0; k < 1000; ++k) ASSERT_TRUE(solver.solve(problem));
  for (std::size_t i = 0; i < static_cast<std::size_t>(problem.rows); ++i)
    EXPECT_NEAR(problem.lambda[i], before[i], 1e-12);
  EXPECT_EQ(solver.rounds(), 1);
}

TEST_P(Cones, DerivativeIsThatOfFiniteDifferences) {
  ContactProblem problem = random_problem(
      GetParam().dimension,
      std::vector<Contact>(static_cast<std::size_t>(GetParam().contacts), {GetParam().friction, false}), 8);
  ConeSolver solver(24, 72);
  ASSERT_TRUE(solver.solve(problem));
  ASSERT_TRUE(solver.solve(problem));
  std::vector<double> db(static_cast<std::size_t>(problem.rows)), dlambda(db.size());
  std::mt19937 random(1);
  for (double& value : db) value = std::normal_distribution<double>()(random);
  solver.derivative(problem, db, dlambda);
  ContactProblem moved = problem;
  constexpr double h = 1e-9;
  for (std::size_t i = 0; i < db.size(); ++i) moved.b[i] += h * db[i];
  ASSERT_TRUE(solver.solve(moved));
  ASSERT_TRUE(solver.solve(moved));
  double largest = 0.0;
  for (const double value : dlambda) largest = std::max(largest, std::abs(value));
  for (std::size_t i = 0; i < db.size(); ++i)
    EXPECT_NEAR((moved.lambda[i] - problem.lambda[i]) / h, dlambda[i], 1e-3 * largest);
}

// Rows that are there for a contact (its tilt) as long as that is closed, and a grab.
TEST(ConeSolver, HeldRowsAreMetOrLeftOutWithTheirOwners) {
  int met = 0;
  int left_out = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    std::vector<Contact> contacts(8, {0.3, false});
    contacts[2].held = true;
    for (const Index owner : {0, 1, 3, 4, 5, 6, 7}) contacts.push_back({0.0, true, owner});
    ContactProblem problem = random_problem(3, contacts, seed);
    ConeSolver solver(24, 72);
    ASSERT_TRUE(solver.solve(problem));
    double force = 0.0;
    for (const double lambda : problem.lambda) force = std::max(force, std::abs(lambda));
    expect_contact(problem, 3e-5 * 1e-3 * force, 3.0 * tuning.cone.tolerance * force);
    for (Index k = 8; k < problem.contacts; ++k)
      ++(problem.lambda[at_contact(problem.first_row(k))] == 0.0 ? left_out : met);
  }
  EXPECT_GT(met, 100);
  EXPECT_GT(left_out, 100);
}

TEST(ConeSolver, WithoutFrictionItIsTheActiveSet) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    ContactProblem cones = random_problem(3, std::vector<Contact>(15, {0.0, false}), seed);
    ContactProblem active = cones;
    ConeSolver cone_solver(20, 60);
    ActiveSet active_set(60);
    ASSERT_TRUE(cone_solver.solve(cones));
    ASSERT_TRUE(active_set.solve(active));
    for (std::size_t i = 0; i < 15; ++i) EXPECT_NEAR(cones.lambda[i], active.lambda[i], 1e-7);
  }
}

}  // namespace
}  // namespace palpate::solvers_test
