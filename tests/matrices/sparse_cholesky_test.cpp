// Factors by supernodes against dense ones.
#include "matrices/sparse_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace palpate {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Edges = std::vector<std::pair<int, int>>;

struct Graph {
  std::string name;
  int nodes;
  Edges edges;
  int dofs = 1;  // of a node
};

Edges grid(int nx, int ny, int nz) {
  Edges edges;
  const auto id = [&](int x, int y, int z) { return (z * ny + y) * nx + x; };
  for (int z = 0; z < nz; ++z) {
    for (int y = 0; y < ny; ++y) {
      for (int x = 0; x < nx; ++x) {
        if (x > 0) edges.emplace_back(id(x, y, z), id(x - 1, y, z));
        if (y > 0) edges.emplace_back(id(x, y, z), id(x, y - 1, z));
        if (z > 0) edges.emplace_back(id(x, y, z), id(x, y, z - 1));
        if (x > 0 && y > 0) edges.emplace_back(id(x, y, z), id(x - 1, y - 1, z));
      }
    }
  }
  return edges;
}

Edges at_random(int nodes, int count) {
  std::mt19937 random(5);
  std::uniform_int_distribution<int> node(0, nodes - 1);
  Edges edges;
  for (int k = 0; k < count; ++k) edges.emplace_back(node(random), node(random));
  return edges;
}

std::vector<Graph> graphs() {
  Edges arrow, chain, all, two = grid(3, 4, 1);
  for (int k = 1; k < 30; ++k) arrow.emplace_back(0, k);
  for (int k = 1; k < 50; ++k) chain.emplace_back(k, k - 1);
  for (int k = 0; k < 20; ++k) {
    for (int j = 0; j < k; ++j) all.emplace_back(k, j);
  }
  for (const auto& [a, b] : grid(2, 2, 4)) two.emplace_back(a + 12, b + 12);
  return {{"one", 1, {}},
          {"diagonal", 7, {}},
          {"arrow", 30, arrow},
          {"chain", 50, chain, 2},
          {"all", 20, all},
          {"two parts", 28, two, 3},
          {"random", 80, at_random(80, 200)},
          {"plane", 12 * 9, grid(12, 9, 1), 2},
          {"space", 5 * 6 * 7, grid(5, 6, 7), 3}};
}

/// The lower triangle of a matrix that is as diagonally dominant as it must be, and not more.
Sparse matrix_of(const Graph& graph, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> value(-1.0, 1.0);
  std::vector<Eigen::Triplet<double>> entries;
  const auto add = [&](int row, int column) {
    const double a = value(random);
    entries.emplace_back(std::max(row, column), std::min(row, column), a);
    entries.emplace_back(row, row, std::abs(a));
    entries.emplace_back(column, column, std::abs(a));
  };
  for (int node = 0; node < graph.nodes; ++node) {
    for (int i = 0; i < graph.dofs; ++i) {
      entries.emplace_back(graph.dofs * node + i, graph.dofs * node + i, 1e-2);
      for (int j = 0; j < i; ++j) add(graph.dofs * node + i, graph.dofs * node + j);
    }
  }
  for (const auto& [a, b] : graph.edges) {
    if (a == b) continue;
    for (int i = 0; i < graph.dofs; ++i) {
      for (int j = 0; j < graph.dofs; ++j) add(graph.dofs * a + i, graph.dofs * b + j);
    }
  }
  Sparse A(graph.dofs * graph.nodes, graph.dofs * graph.nodes);
  A.setFromTriplets(entries.begin(), entries.end());
  return A;
}

Eigen::MatrixXd dense(const Sparse& A) {
  return Eigen::MatrixXd(A).selfadjointView<Eigen::Lower>();
}

TEST(SparseCholesky, SolvesAsADenseFactorDoes) {
  for (const Graph& graph : graphs()) {
    SCOPED_TRACE(graph.name);
    SparseCholesky factor;
    factor.analyse(matrix_of(graph, 1));
    for (const unsigned seed : {1U, 2U}) {  // of one pattern
      const Sparse A = matrix_of(graph, seed);
      ASSERT_TRUE(factor.factorise(A));
      const Eigen::MatrixXd b = Eigen::MatrixXd::Random(A.rows(), 4), expected = dense(A).llt().solve(b);
      EXPECT_LT((factor.solve(b) - expected).norm(), 1e-11 * expected.norm());
      const Eigen::VectorXd x = factor.solve(Eigen::VectorXd(b.col(2)));
      EXPECT_LT((x - expected.col(2)).norm(), 1e-11 * expected.norm());
    }
  }
}

TEST(SparseCholesky, KeptUnknownsGetTheSchurComplement) {
  for (const Graph& graph : graphs()) {
    SCOPED_TRACE(graph.name);
    for (const int kept : {1, (graph.dofs * graph.nodes + 2) / 3, graph.dofs * graph.nodes}) {
      SparseCholesky factor;
      factor.analyse(matrix_of(graph, 1), kept);
      for (const unsigned seed : {1U, 2U}) {
        Sparse A = matrix_of(graph, seed);
        A.coeffRef(A.rows() - 1, A.rows() - 1) = -1.0;  // kept ones need not be definite
        ASSERT_TRUE(factor.factorise(A));
        const Eigen::MatrixXd all = dense(A);
        const Eigen::Index n = A.rows() - kept;
        const Eigen::MatrixXd coupling = all.bottomLeftCorner(kept, n),
                              back = all.topLeftCorner(n, n).llt().solve(coupling.transpose()),
                              expected = all.bottomRightCorner(kept, kept) - coupling * back,
                              schur = Eigen::MatrixXd(factor.schur()).selfadjointView<Eigen::Lower>();
        EXPECT_LT((schur - expected).norm(), 1e-11 * expected.norm());
        const Eigen::VectorXd x = Eigen::VectorXd::Random(kept);
        EXPECT_LT((factor.extended(x) + back * x).norm(), 1e-11 * (1.0 + (back * x).norm()));
      }
    }
  }
}

TEST(SparseCholesky, ReadsTheLowerTriangleAlone) {
  const Sparse lower = matrix_of({"plane", 30, grid(6, 5, 1), 2}, 3);
  Eigen::MatrixXd both = dense(lower);
  both.triangularView<Eigen::StrictlyUpper>() = 7.0 * both;
  const Sparse A = both.sparseView();
  SparseCholesky factor;
  factor.analyse(A);
  ASSERT_TRUE(factor.factorise(A));
  const Eigen::VectorXd b = Eigen::VectorXd::Random(A.rows()), expected = dense(lower).llt().solve(b);
  EXPECT_LT((factor.solve(b) - expected).norm(), 1e-11 * expected.norm());
}

TEST(SparseCholesky, RefusesWhatIsNotPositiveDefiniteOrNotFinite) {
  const Graph graph{"space", 60, grid(3, 4, 5), 3};
  const Sparse A = matrix_of(graph, 4);
  SparseCholesky factor;
  factor.analyse(A);
  for (const int dof : {0, 77, 179}) {
    for (const double value : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
      Sparse broken = A;
      broken.coeffRef(dof, dof) = value;
      EXPECT_FALSE(factor.factorise(broken)) << dof << " " << value;
    }
  }
  EXPECT_FALSE(factor.factorise(0.0 * A));
  ASSERT_TRUE(factor.factorise(A)) << "after matrices that it refused";
  const Eigen::VectorXd b = Eigen::VectorXd::Random(A.rows()), expected = dense(A).llt().solve(b);
  EXPECT_LT((factor.solve(b) - expected).norm(), 1e-11 * expected.norm());
}

TEST(SparseCholesky, TellsByTheSmallestEigenvalueWhetherAMatrixIsDefinite) {
  const Graph graph{"plane", 60, grid(10, 6, 1), 2};
  const Sparse A = matrix_of(graph, 6);
  const double smallest = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(dense(A)).eigenvalues()[0];
  Sparse I(A.rows(), A.cols());
  I.setIdentity();
  SparseCholesky factor;
  factor.analyse(A);
  EXPECT_TRUE(factor.factorise(A - 0.999 * smallest * I));
  EXPECT_FALSE(factor.factorise(A - 1.001 * smallest * I));
}

TEST(SparseCholesky, AMatrixWithoutRowsIsSolved) {
  SparseCholesky factor;
  factor.analyse(Sparse(0, 0));
  EXPECT_TRUE(factor.factorise(Sparse(0, 0)));
  EXPECT_EQ(factor.solve(Eigen::VectorXd(0)).size(), 0);
}

/// An order by minimum degree: a plane of n nodes has some n log n entries, where a band has n^1.5.
TEST(SparseCholesky, EntriesStayFew) {
  for (const int side : {20, 40, 80}) {
    const Sparse A = matrix_of({"plane", side * side, grid(side, side, 1)}, 7);
    SparseCholesky factor;
    factor.analyse(A);
    const double n = side * side;
    EXPECT_LT(static_cast<double>(factor.entries()), 3.5 * n * std::log2(n)) << side;
  }
}

}  // namespace
}  // namespace palpate
