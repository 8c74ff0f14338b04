// Selected blocks of K^-1 against the dense inverse.
#include "precompute/compression/selected_solver.h"

#include <cblas.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "meshes/generate.h"
#include "tests/support/bodies/precompute_case.h"
#include "tests/support/second_routes/dense_algebra.h"

namespace palpate::selected_solver_test {
namespace {

using Dofs = std::vector<std::int64_t>;
using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

const Material soft{1.0e4, 0.45, 1000.0};

/// A factorised body, its dense inverse and a solver.
struct Body {
  Stiffness stiffness;
  Factor factor;
  Eigen::MatrixXd inverse;
  SelectedSolver solver;

  explicit Body(const test::ElasticCase& elastic)
      : stiffness(assemble_stiffness(elastic.body())),
        factor(stiffness.K, stiffness.node_start),
        inverse(dense_inverse(stiffness.K)),
        solver(factor) {
    openblas_set_num_threads(1);  // as a bake does
    factor.factorize();
  }

  static Eigen::MatrixXd dense_inverse(const SparseMatrix& K) {
    const Eigen::MatrixXd full = Eigen::MatrixXd(K).selfadjointView<Eigen::Lower>();
    return test::inverse_of(full);
  }

  [[nodiscard]] Rows expected(const Dofs& rows, const Dofs& columns) const {
    Rows block = Rows::Zero(std::ssize(rows), std::ssize(columns));
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (std::size_t j = 0; j < columns.size(); ++j)
        if (rows[i] >= 0 && columns[j] >= 0)
          block(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = inverse(rows[i], columns[j]);
    }
    return block;
  }
  [[nodiscard]] Rows solved(const Dofs& rows, const Dofs& columns,
                            SelectedSolver::Workspace& workspace) const {
    Rows block = Rows::Constant(std::ssize(rows), std::ssize(columns), 1e30);
    solver.solve(rows, columns, workspace, {block.data(), static_cast<std::size_t>(block.size())});
    return block;
  }
  void expect_block(const Dofs& rows, const Dofs& columns, SelectedSolver::Workspace& workspace) const {
    ASSERT_LE((solved(rows, columns, workspace) - expected(rows, columns)).cwiseAbs().maxCoeff(),
              1e-11 * inverse.cwiseAbs().maxCoeff())
        << rows.size() << " rows, " << columns.size() << " columns";
  }
  [[nodiscard]] Dofs all() const {
    Dofs dofs(static_cast<std::size_t>(inverse.rows()));
    std::iota(dofs.begin(), dofs.end(), 0);
    return dofs;
  }
  /// Any dofs, -1 among them and some more than once.
  [[nodiscard]] Dofs some(std::size_t count, std::mt19937_64& random) const {
    Dofs dofs;
    for (std::size_t k = 0; k < count; ++k)
      dofs.push_back(static_cast<std::int64_t>(random() % std::uint64_t(inverse.rows() + 1)) - 1);
    return dofs;
  }
};

test::ElasticCase block(ElementType element = ElementType::tet4) {
  return {generate(BoxShape{Vec3::Zero(), Vec3(0.1, 0.08, 0.06), {6, 5, 4}}, element), soft};
}

bool at_bottom(const Vec3& x) {
  return x.z() < 1e-9;
}

/// Blocks of all sizes one after the other with one workspace, which holds what was there before.
void expect_blocks(const Body& body) {
  std::mt19937_64 random(5);
  SelectedSolver::Workspace workspace;
  const Dofs all = body.all();
  body.expect_block(all, all, workspace);
  for (const std::size_t rows : {1, 2, 50, 7, 300}) {
    for (const std::size_t columns : {1, 90, 3, 200})
      body.expect_block(body.some(rows, random), body.some(columns, random), workspace);
  }
  for (int k = 0; k < 30; ++k) body.expect_block(body.some(1, random), body.some(1, random), workspace);
}

TEST(SelectedSolver, EqualsTheDenseInverse) {
  expect_blocks(Body(block().hold(at_bottom, 7)));
  expect_blocks(Body(block(ElementType::hex8).hold(at_bottom, 7)));
}

TEST(SelectedSolver, EqualsTheDenseInverseInThePlaneAndOnRollers) {
  expect_blocks(Body(block().hold(at_bottom, 4).hold([](const Vec3& x) { return x.x() < 1e-9; }, 3)));
  const Mesh plate = generate(RectangleShape{Vec3::Zero(), Vec3(1.0, 1.0, 0.0), {9, 8}}, ElementType::tri3);
  expect_blocks(Body(test::ElasticCase(plate, soft).hold([](const Vec3& x) { return x.y() < 1e-9; }, 3)));
}

TEST(SelectedSolver, HeldDofsHaveZeros) {
  const Body body(block().hold(at_bottom, 7));
  SelectedSolver::Workspace workspace;
  body.expect_block(body.all(), body.all(), workspace);  // leaves numbers everywhere
  const Rows block = body.solved({-1, 5}, {7, -1}, workspace);
  EXPECT_EQ(block.row(0), Rows::Zero(1, 2));
  EXPECT_EQ(block.col(1), Rows::Zero(2, 1));
  EXPECT_NE(block(1, 0), 0.0);
  EXPECT_EQ(body.solved({-1, -1}, {3, 4, 5}, workspace), Rows::Zero(2, 3));
  EXPECT_EQ(body.solved({0, 1}, {-1, -1}, workspace), Rows::Zero(2, 2));
  EXPECT_EQ(body.solved({-1}, {-1}, workspace), Rows::Zero(1, 1));
  body.expect_block({4, 4, -1, 4}, {9, -1, 9, 9}, workspace);
}

TEST(SelectedSolver, EmptyBlocks) {
  const Body body(block().hold(at_bottom, 7));
  SelectedSolver::Workspace workspace;
  EXPECT_EQ(body.solved({}, {1, 2}, workspace).size(), 0);
  EXPECT_EQ(body.solved({1, 2}, {}, workspace).size(), 0);
}

// The elimination tree is a forest: what the columns of one part leave behind must not come into the other.
TEST(SelectedSolver, BodyCutInTwoByAClampedSlice) {
  const Mesh mesh = generate(BoxShape{Vec3::Zero(), Vec3(0.1, 0.05, 0.05), {6, 3, 3}});
  const test::ElasticCase elastic =
      test::ElasticCase(mesh, soft).hold([](const Vec3& x) { return std::abs(x.x() - 0.05) < 1e-9; }, 7);
  const Body body(elastic);
  expect_blocks(body);
  Dofs left, right;
  for (const std::int64_t dof : body.all()) {
    const std::int64_t node = body.stiffness.free_dofs[static_cast<std::size_t>(dof)] / 3;
    (elastic.mesh.nodes[static_cast<std::size_t>(node)].x() < 0.05 ? left : right).push_back(dof);
  }
  ASSERT_FALSE(left.empty() || right.empty());
  SelectedSolver::Workspace workspace;
  body.expect_block(body.all(), body.all(), workspace);
  for (double& x : workspace.sweep.X) x = std::numeric_limits<double>::quiet_NaN();
  for (double& x : workspace.sweep.below) x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(body.solved(left, right, workspace), Rows::Zero(std::ssize(left), std::ssize(right)));
  EXPECT_EQ(body.solved(right, left, workspace), Rows::Zero(std::ssize(right), std::ssize(left)));
  body.expect_block(left, body.all(), workspace);
}

// Rounded once, and then in every step: off by some roundings of the largest entry, not by the condition of
// K.
TEST(SelectedSolver, InSinglePrecisionIsRounded) {
  const Body body(block().hold(at_bottom, 7));
  const SelectedSolverOf<float> single(body.factor), by_three(body.factor, 3);
  SelectedSolverOf<float>::Workspace workspace;
  using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  std::mt19937_64 random(8);
  for (int k = 0; k < 10; ++k) {
    const Dofs rows = body.some(1 + random() % 200, random), columns = body.some(1 + random() % 90, random);
    for (std::vector<float>* stale : {&workspace.sweep.X, &workspace.sweep.below})
      std::fill(stale->begin(), stale->end(), std::numeric_limits<float>::quiet_NaN());
    FloatRows block(std::ssize(rows), std::ssize(columns)), again = block;
    single.solve(rows, columns, workspace, {block.data(), static_cast<std::size_t>(block.size())});
    by_three.solve(rows, columns, workspace, {again.data(), static_cast<std::size_t>(again.size())});
    EXPECT_EQ(block, again);
    EXPECT_LT((block.cast<double>() - body.expected(rows, columns)).cwiseAbs().maxCoeff(),
              1e-5 * body.inverse.cwiseAbs().maxCoeff());

    const Dofs dofs = [&] {  // each once
      Dofs some = body.all();
      std::shuffle(some.begin(), some.end(), random);
      some.resize(50);
      return some;
    }();
    const FloatRows f =
        FloatRows::NullaryExpr(50, 3, [&] { return static_cast<float>(random() % 100) - 50.0F; });
    FloatRows u(50, 3);
    single.multiply(dofs, 3, {f.data(), 150}, workspace, {u.data(), 150});
    const Rows u_0 = body.expected(dofs, dofs) * f.cast<double>();
    EXPECT_LT((u.cast<double>() - u_0).cwiseAbs().maxCoeff(), 1e-4 * u_0.cwiseAbs().maxCoeff());
  }
}

/// Products of the forward solutions of some clusters with those of others, against the dense inverse.
void expect_products(const Body& body, std::size_t together, std::mt19937_64& random) {
  SelectedSolver::Workspace workspace;
  std::vector<std::vector<Dofs>> groups(2);
  std::vector<ForwardSolution<double>> solutions;
  for (auto& group : groups) {
    for (std::size_t c = 0; c < together; ++c) group.push_back(body.some(1 + random() % 20, random));
    solutions.push_back(body.solver.forward(group, workspace));
  }
  for (std::size_t first = 0; first < together; ++first) {
    Dofs rows;
    for (std::size_t end = first + 1; end <= together; ++end) {
      rows.insert(rows.end(), groups[0][end - 1].begin(), groups[0][end - 1].end());
      const Dofs& columns = groups[1][first];
      Rows block = Rows::Constant(std::ssize(rows), std::ssize(columns), 1e30);
      multiply<double>({solutions[0], first, end}, {solutions[1], first, first + 1},
                       {block.data(), static_cast<std::size_t>(block.size())});
      ASSERT_LE((block - body.expected(rows, columns)).cwiseAbs().maxCoeff(),
                1e-11 * body.inverse.cwiseAbs().maxCoeff())
          << "clusters " << first << " to " << end << " of " << together;
    }
  }
}

TEST(SelectedSolver, ProductsOfForwardSolutionsAreBlocksOfTheInverse) {
  std::mt19937_64 random(8);
  for (const Body& body :
       {Body(block().hold(at_bottom, 7)), Body(block(ElementType::hex8).hold(at_bottom, 7))}) {
    for (const std::size_t together : {1, 2, 8}) expect_products(body, together, random);
  }
}

TEST(SelectedSolver, MoreDofsAreNotFewerFlops) {
  const Body body(block().hold(at_bottom, 7));
  std::mt19937_64 random(6);
  const Dofs all = body.all();
  for (int k = 0; k < 20; ++k) {
    Dofs dofs = body.some(1, random);
    double last = body.solver.forward_flops(dofs);
    for (int more = 0; more < 10; ++more) {
      const Dofs added = body.some(5, random);
      dofs.insert(dofs.end(), added.begin(), added.end());
      const double flops = body.solver.forward_flops(dofs);
      EXPECT_GE(flops, last);
      last = flops;
    }
    EXPECT_LE(last / static_cast<double>(dofs.size()),
              body.solver.forward_flops(all) / static_cast<double>(all.size()));
  }
  EXPECT_EQ(body.solver.forward_flops({}), 0.0);
  EXPECT_EQ(body.solver.forward_flops(Dofs{-1}), 0.0);
  // All of L, off the diagonal a product and a sum, on it a division: about two flops an entry.
  const double of_L = body.solver.forward_flops(all) / static_cast<double>(all.size());
  EXPECT_LT(of_L, 2.1 * static_cast<double>(body.factor.entries()));
}

}  // namespace
}  // namespace palpate::selected_solver_test
