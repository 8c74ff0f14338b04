// The bound of what a matrix in nested low-rank form lacks, against its formula with all entries written out.
#include "matrices/error_bound.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "tests/support/compression/hierarchical_sample.h"

namespace palpate::error_bound_test {
namespace {

/// Forces on nodes.
struct Load {
  std::vector<Index> nodes;
  std::vector<double> f;
};

class ErrorBoundTest : public testing::TestWithParam<test::HierarchicalKind> {
 protected:
  ErrorBoundTest() {
    // A leaf's block is positive definite as Xi is.
    const double largest = full_.cwiseAbs().maxCoeff();
    for (Index c = matrix_.tree.first_leaf(); c < matrix_.tree.clusters(); ++c) {
      auto block = full_.block(first(c), first(c), dofs(c), dofs(c));
      block += largest * static_cast<double>(dofs(c)) * Eigen::MatrixXd::Identity(dofs(c), dofs(c));
      put_near(c, block / matrix_.scale);
    }
  }

  [[nodiscard]] Eigen::Index first(Index c) const { return d_ * matrix_.tree.begin(c); }
  [[nodiscard]] Eigen::Index dofs(Index c) const {
    return d_ * (matrix_.tree.end(c) - matrix_.tree.begin(c));
  }

  /// The block of a leaf with itself.
  void put_near(Index c, const Eigen::MatrixXd& block) {
    const auto pair = static_cast<std::size_t>(matrix_.first_near_pair(c - matrix_.tree.first_leaf()));
    float* entries = const_cast<float*>(matrix_.near.get()) + matrix_.near_at[pair];
    for (const double value : block.reshaped<Eigen::RowMajor>()) *entries++ = static_cast<float>(value);
  }

  Load random_load(std::size_t count) {
    Load load;
    for (std::size_t k = 0; k < count; ++k) {
      load.nodes.push_back(static_cast<Index>(random_() % std::uint64_t(matrix_.tree.nodes)));
      for (int axis = 0; axis < d_; ++axis) load.f.push_back(test::random_number(random_));
    }
    return load;
  }

  /// |f|^2 of a cluster: f^T Xi f of the leaves below it.
  [[nodiscard]] double squared(Index c, const Load& load) const {
    if (c < matrix_.tree.first_leaf()) return squared(2 * c + 1, load) + squared(2 * c + 2, load);
    Eigen::VectorXd all = Eigen::VectorXd::Zero(full_.rows());
    for (std::size_t k = 0; k < load.nodes.size(); ++k)
      for (Eigen::Index axis = 0; axis < d_; ++axis)
        all[d_ * load.nodes[k] + axis] += load.f[k * static_cast<std::size_t>(d_) + std::size_t(axis)];
    const Eigen::VectorXd f = all.segment(first(c), dofs(c));
    return f.dot(full_.block(first(c), first(c), dofs(c), dofs(c)) * f);
  }

  [[nodiscard]] double expected(const Load& f, const Load& y) const {
    double sum = 0.0;
    for (std::size_t p = 0; p < matrix_.far_pair.size(); ++p) {
      const auto [a, b] = matrix_.far_pair[p];
      sum += std::pow(matrix_.pair_error[p], 2) / double(dofs(a) * dofs(b)) *
             (squared(a, y) * squared(b, f) + squared(b, y) * squared(a, f));
    }
    return 24.0 * std::sqrt(sum);
  }

  void expect_bound(ErrorBound& bound, const Load& f, const Load& y) const {
    bound.carry(f.nodes, f.f);
    const double found = bound.work(y.nodes, y.f), formula = expected(f, y);
    EXPECT_NEAR(found, formula, 1e-5 * formula) << f.nodes.size() << " and " << y.nodes.size() << " nodes";
  }

  HierarchicalMatrix matrix_ = test::random_hierarchical(GetParam(), 5);
  Eigen::MatrixXd full_ = test::written_out(matrix_);
  Eigen::Index d_ = GetParam().dimension;
  std::mt19937_64 random_{3};
};

TEST_P(ErrorBoundTest, IsTheFormula) {
  ErrorBound bound(matrix_, 60);
  for (const std::size_t count : {0U, 1U, 5U, 60U}) {
    for (int k = 0; k < 5; ++k) {
      const Load f = random_load(count), y = random_load(1 + count / 2);
      expect_bound(bound, f, y);
    }
  }
}

TEST_P(ErrorBoundTest, OfANodeThatIsThereTwiceIsThatOfTheSum) {
  ErrorBound bound(matrix_, 60);
  Load twice = random_load(10);
  twice.nodes.push_back(twice.nodes.front());
  twice.f.insert(twice.f.end(), static_cast<std::size_t>(d_), 0.5);
  expect_bound(bound, twice, random_load(7));
  expect_bound(bound, random_load(7), twice);
}

// Nodes of one leaf are near each other, others may be far from it.
TEST_P(ErrorBoundTest, OfOtherNodesThanThoseThatCarryForce) {
  ErrorBound bound(matrix_, 20);
  const Index leaf = matrix_.tree.first_leaf();
  Load f = random_load(4);
  for (Index& node : f.nodes)
    node = matrix_.tree.begin(leaf) + node % (matrix_.tree.end(leaf) - matrix_.tree.begin(leaf));
  const Load y = random_load(20);
  bound.carry(f.nodes, f.f);
  EXPECT_EQ(bound.work(f.nodes, f.f), 0.0);
  for (int k = 0; k < 2; ++k)
    EXPECT_NEAR(bound.work(y.nodes, y.f), expected(f, y), 1e-5 * expected(f, y)) << "call " << k;
  EXPECT_EQ(bound.work(f.nodes, f.f), 0.0);
}

TEST_P(ErrorBoundTest, ACopyIsIndependent) {
  ErrorBound bound(matrix_, 20);
  const Load f = random_load(20), y = random_load(20), other = random_load(3);
  bound.carry(f.nodes, f.f);
  ErrorBound copy = bound;
  bound.carry(other.nodes, other.f);
  EXPECT_NEAR(copy.work(y.nodes, y.f), expected(f, y), 1e-5 * expected(f, y));
}

TEST_P(ErrorBoundTest, OfMoreNodesThanThereIsRoomForIsThatOfTheFirstOnes) {
  ErrorBound bound(matrix_, 8);
  Load f = random_load(12);
  const Load y = random_load(8);
  bound.carry(f.nodes, f.f);
  const double found = bound.work(y.nodes, y.f);
  f.nodes.resize(8);
  EXPECT_NEAR(found, expected(f, y), 1e-5 * expected(f, y));
}

std::string case_name(const testing::TestParamInfo<test::HierarchicalKind>& info) {
  return std::to_string(info.param.dimension) + "d_" + std::to_string(info.param.nodes) + "_nodes_" +
         std::to_string(info.param.levels) + "_levels";
}

INSTANTIATE_TEST_SUITE_P(Kinds, ErrorBoundTest,
                         testing::Values(test::HierarchicalKind{.dimension = 3, .nodes = 7, .levels = 0},
                                         test::HierarchicalKind{.dimension = 2, .nodes = 43, .levels = 3},
                                         test::HierarchicalKind{
                                             .dimension = 3, .nodes = 101, .levels = 5, .scale = 3.0}),
                         case_name);

}  // namespace
}  // namespace palpate::error_bound_test
