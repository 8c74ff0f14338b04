// MUMPS's factor in a single rank, against CHOLMOD's.
#include "precompute/cluster/mumps_numbers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "base/error.h"
#include "precompute/numerics/factor.h"
#include "precompute/spread_plan.h"

/// OpenMPI leaks in modules that it has closed again, whose names are then not known.
// NOLINTNEXTLINE(bugprone-reserved-identifier,readability-identifier-naming): the sanitizer's name
extern "C" __attribute__((visibility("default"))) const char* __asan_default_options() {
  return "detect_leaks=0";
}

namespace palpate::mumps_numbers_test {
namespace {

/// A chain of springs of stiffness 1, held at one end: K^-1_ij = min(i, j) + 1.
SparseMatrix chain(std::int64_t n) {
  std::vector<Eigen::Triplet<double, std::int64_t>> entries;
  for (std::int64_t i = 0; i < n; ++i) {
    entries.emplace_back(i, i, i + 1 < n ? 2.0 : 1.0);
    if (i + 1 < n) entries.emplace_back(i + 1, i, -1.0);
  }
  SparseMatrix K(n, n);
  K.setFromTriplets(entries.begin(), entries.end());
  return K;
}

/// A cube of n^3 nodes that neighbours hold together, each held by a weak spring: it has large fronts.
SparseMatrix cube(std::int64_t n) {
  std::vector<Eigen::Triplet<double, std::int64_t>> entries;
  for (std::int64_t i = 0; i < n * n * n; ++i) {
    entries.emplace_back(i, i, 6.1);
    if (i % n + 1 < n) entries.emplace_back(i + 1, i, -1.0);
    if (i / n % n + 1 < n) entries.emplace_back(i + n, i, -1.0);
    if (i + n * n < n * n * n) entries.emplace_back(i + n * n, i, -1.0);
  }
  SparseMatrix K(n * n * n, n * n * n);
  K.setFromTriplets(entries.begin(), entries.end());
  return K;
}

std::vector<std::int64_t> natural(std::int64_t n) {
  std::vector<std::int64_t> order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), 0);
  return order;
}

class MumpsNumbers : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    int provided = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  }
  static void TearDownTestSuite() { MPI_Finalize(); }
};

TEST_F(MumpsNumbers, SolvesAChainOfSprings) {
  const SparseMatrix K = chain(6);
  const auto numbers = make_mumps_numbers(MPI_COMM_WORLD, K, natural(6), {});
  numbers->factorize();
  std::vector<double> b(12, 0.0);
  b[5] = 1.0;
  b[6] = 1.0;
  const std::vector<double> x = numbers->solve(b, 2);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(x[i], static_cast<double>(i) + 1.0, 1e-13);
    EXPECT_NEAR(x[6 + i], 1.0, 1e-13);
  }
}

TEST_F(MumpsNumbers, ColumnsOfTheLowerTriangleAreZeroWhereHeld) {
  const SparseMatrix K = chain(6);
  const auto numbers = make_mumps_numbers(MPI_COMM_WORLD, K, natural(6), {});
  numbers->factorize();
  const std::vector<std::int64_t> dofs = {4, -1, 2, -1};
  std::vector<double> packed;
  spread_columns(*numbers, dofs, 0, 4, packed);
  const std::vector<double> expected = {5, 0, 3, 0, 0, 0, 0, 3, 0, 0};
  ASSERT_EQ(packed.size(), expected.size());
  for (std::size_t k = 0; k < expected.size(); ++k) EXPECT_NEAR(packed[k], expected[k], 1e-13) << k;
  spread_columns(*numbers, dofs, 3, 1, packed);
  EXPECT_EQ(packed, std::vector<double>{0.0});
}

TEST_F(MumpsNumbers, MultipliesSparseLoads) {
  const SparseMatrix K = chain(6);
  const auto numbers = make_mumps_numbers(MPI_COMM_WORLD, K, natural(6), {});
  numbers->factorize();
  const std::vector<std::int64_t> from = {0, -1, 5}, to = {5, -1, 1, 5};
  const std::vector<double> f = {1, 0, 7, 7, 2, 0};  // two columns; the second is empty
  std::vector<double> u(8, -1.0);
  numbers->multiply(from, 2, f, to, u);
  const std::vector<double> expected = {1 + 2 * 6, 0, 0, 0, 1 + 2 * 2, 0, 1 + 2 * 6, 0};
  for (std::size_t k = 0; k < u.size(); ++k) EXPECT_NEAR(u[k], expected[k], 1e-12) << k;
}

TEST_F(MumpsNumbers, TooLittleWorkSpaceIsFoundAndRaised) {
  const SparseMatrix K = cube(12);
  std::vector<std::int64_t> node_start(static_cast<std::size_t>(K.cols()) + 1);
  std::iota(node_start.begin(), node_start.end(), 0);
  Factor factor(K, node_start);
  factor.factorize();
  const auto numbers =
      make_mumps_numbers(MPI_COMM_WORLD, K, factor.permutation(), {.threads = 1, .room = -60});
  numbers->factorize();
  EXPECT_GE(numbers->memory().room, 20);
  const std::vector<double> b(static_cast<std::size_t>(K.cols()), 1.0);
  const std::vector<double> x = numbers->solve(b, 1), expected = factor.solve(b);
  for (std::size_t i = 0; i < x.size(); ++i) ASSERT_NEAR(x[i], expected[i], 1e-10);
}

TEST_F(MumpsNumbers, AnIndefiniteMatrixIsRefused) {
  SparseMatrix K = chain(6);
  K.coeffRef(3, 3) = -5.0;
  const auto numbers = make_mumps_numbers(MPI_COMM_WORLD, K, natural(6), {});
  try {
    numbers->factorize();
    FAIL() << "it was taken";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "K is not positive definite");
  }
}

}  // namespace
}  // namespace palpate::mumps_numbers_test
