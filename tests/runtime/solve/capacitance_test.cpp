// The factor that grows and shrinks against Eigen's, computed afresh.
#include "runtime/core/solve/capacitance.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "base/error.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate::capacitance_test {
namespace {

/// C and its nodes, grown and shrunk together.
class Capacitance {
 public:
  Capacitance(const Eigen::MatrixXd& xi, int dimension, Index max_nodes)
      : xi_(&xi), C_(dimension, max_nodes) {}

  CapacitanceStatus add(Index node) {
    std::vector<Index> columns = nodes_;
    columns.push_back(node);
    const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> blocks =
        (*xi_)(dofs({node}), dofs(columns));
    const CapacitanceStatus status = C_.add({blocks.data(), static_cast<std::size_t>(blocks.size())});
    if (status == CapacitanceStatus::ok) nodes_ = columns;
    return status;
  }

  /// In place of those that are held.
  CapacitanceStatus assign(const std::vector<Index>& nodes) {
    nodes_ = nodes;
    const Eigen::MatrixXd C = fresh();
    std::vector<double> lower;
    for (Eigen::Index j = 0; j < C.cols(); ++j) {
      for (Eigen::Index i = j; i < C.rows(); ++i) lower.push_back(C(i, j));
    }
    const CapacitanceStatus status = C_.assign(static_cast<Index>(nodes.size()), lower);
    if (status != CapacitanceStatus::ok) nodes_.clear();
    return status;
  }

  void remove(Index k) {
    C_.remove(k);
    nodes_.erase(nodes_.begin() + k);
  }

  [[nodiscard]] Eigen::MatrixXd fresh() const { return (*xi_)(dofs(nodes_), dofs(nodes_)); }

  /// Largest difference from the fresh factor, relative to its largest entry.
  [[nodiscard]] double error() const {
    if (nodes_.empty()) return 0.0;
    const Eigen::MatrixXd L = fresh().llt().matrixL();
    double largest = 0.0;
    for (Eigen::Index j = 0; j < L.cols(); ++j) {
      for (Eigen::Index i = j; i < L.rows(); ++i)
        largest = std::max(largest, std::abs(C_.factor(i, j) - L(i, j)));
    }
    return largest / L.cwiseAbs().maxCoeff();
  }

  [[nodiscard]] std::vector<Eigen::Index> dofs(const std::vector<Index>& nodes) const {
    std::vector<Eigen::Index> all;
    for (const Index node : nodes) {
      const Index first = C_.dimension() * node;
      for (Eigen::Index axis = 0; axis < C_.dimension(); ++axis) all.push_back(first + axis);
    }
    return all;
  }

  const Eigen::MatrixXd* xi_;
  CapacitanceMatrix C_;
  std::vector<Index> nodes_;
};

Eigen::MatrixXd random_greens(int dimension, Eigen::Index nodes) {
  return test::random_definite(dimension * nodes, 5);
}

/// The Green's functions of a body, much worse conditioned than random ones; with one dof a node, those of a
/// cube's vertical motion alone.
Eigen::MatrixXd body_greens(int dimension) {
  const int d = dimension == 2 ? 2 : 3;
  const Model model = test::unit_model(d, d == 3 ? 5 : 20, Scope::surface, Precision::double_precision);
  const auto every = d / dimension;
  Eigen::MatrixXd xi(model.greens.order() / every, model.greens.order() / every);
  for (Eigen::Index i = 0; i < xi.rows(); ++i) {
    for (Eigen::Index j = 0; j < xi.cols(); ++j)
      xi(i, j) = model.greens(every * i + every - 1, every * j + every - 1);
  }
  return xi;
}

/// With one, two and three dofs a node.
class CapacitanceMatrices : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Dimension, CapacitanceMatrices, testing::Values(1, 2, 3));

TEST_P(CapacitanceMatrices, FactorIsThatOfAFreshFactorisation) {
  const Eigen::MatrixXd xi = random_greens(GetParam(), 60);
  Capacitance capacitance(xi, GetParam(), 60);
  for (Index node = 59; node >= 0; --node) ASSERT_EQ(capacitance.add(node), CapacitanceStatus::ok);
  EXPECT_EQ(capacitance.C_.nodes(), 60);
  EXPECT_LT(capacitance.error(), 1e-13);
}

// As many columns as go together, some fewer and some more; the factor then grows and shrinks as any.
TEST_P(CapacitanceMatrices, TakesManyNodesAtOnce) {
  const Eigen::MatrixXd xi = random_greens(GetParam(), 40);
  for (const Index count : {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 37}) {
    Capacitance capacitance(xi, GetParam(), 40);
    ASSERT_EQ(capacitance.add(39), CapacitanceStatus::ok);
    std::vector<Index> nodes(static_cast<std::size_t>(count));
    std::iota(nodes.rbegin(), nodes.rend(), 0);
    ASSERT_EQ(capacitance.assign(nodes), CapacitanceStatus::ok) << count;
    EXPECT_EQ(capacitance.C_.nodes(), count);
    EXPECT_LT(capacitance.error(), 1e-13) << count;
    ASSERT_EQ(capacitance.add(38), CapacitanceStatus::ok);
    capacitance.remove(0);
    EXPECT_LT(capacitance.error(), 1e-13) << count << ", and one more, and one less";
  }
}

TEST_P(CapacitanceMatrices, HoldsNoneOfManyThatDependOnEachOtherOrDoNotFit) {
  const Eigen::MatrixXd xi = random_greens(GetParam(), 8);
  Capacitance capacitance(xi, GetParam(), 6);
  for (const std::vector<Index>& nodes : {std::vector<Index>{0, 1, 2, 3, 4, 1}, std::vector<Index>{2, 2}}) {
    ASSERT_EQ(capacitance.assign({5, 6}), CapacitanceStatus::ok);
    EXPECT_EQ(capacitance.assign(nodes), CapacitanceStatus::not_positive_definite);
    EXPECT_EQ(capacitance.C_.nodes(), 0);
  }
  EXPECT_EQ(capacitance.assign({0, 1, 2, 3, 4, 5, 6}), CapacitanceStatus::full);
  EXPECT_EQ(capacitance.C_.nodes(), 0);
  EXPECT_EQ(capacitance.assign({0, 1, 2, 3, 4, 5}), CapacitanceStatus::ok);
  EXPECT_LT(capacitance.error(), 1e-13);
}

TEST_P(CapacitanceMatrices, SolveInvertsC) {
  const Eigen::MatrixXd xi = random_greens(GetParam(), 45);
  Capacitance capacitance(xi, GetParam(), 64);
  for (Index node = 0; node < 45; ++node) ASSERT_EQ(capacitance.add(node), CapacitanceStatus::ok);
  const Eigen::VectorXd u = Eigen::VectorXd::LinSpaced(xi.rows(), -1.0, 2.0);
  Eigen::VectorXd f = u;
  capacitance.C_.solve({f.data(), static_cast<std::size_t>(f.size())});
  EXPECT_LT((capacitance.fresh() * f - u).norm(), 1e-12 * u.norm());
}

TEST_P(CapacitanceMatrices, SolvesSeveralSystemsAtOnce) {
  const Eigen::MatrixXd xi = random_greens(GetParam(), 12);
  Capacitance capacitance(xi, GetParam(), 12);
  for (Index node = 0; node < 12; node += 2) ASSERT_EQ(capacitance.add(node), CapacitanceStatus::ok);
  const Eigen::MatrixXd C = capacitance.fresh();
  for (const int systems : {1, 2, 3}) {
    const Eigen::MatrixXd u = Eigen::MatrixXd::Random(C.rows(), systems);
    Eigen::MatrixXd f = u;
    capacitance.C_.solve({f.data(), static_cast<std::size_t>(f.size())}, systems);
    EXPECT_LT((C * f - u).norm(), 1e-12 * u.norm() * C.norm() * C.inverse().norm()) << systems;
  }
}

TEST_P(CapacitanceMatrices, RemovesFirstMiddleAndLast) {
  const Eigen::MatrixXd xi = random_greens(GetParam(), 20);
  for (const Index k : {0, 9, 19}) {
    Capacitance capacitance(xi, GetParam(), 20);
    for (Index node = 0; node < 20; ++node) ASSERT_EQ(capacitance.add(node), CapacitanceStatus::ok);
    capacitance.remove(k);
    EXPECT_LT(capacitance.error(), 1e-13) << k;
  }
}

// Through 1000 changes.
TEST_P(CapacitanceMatrices, AgreesAfterAThousandRandomAdditionsAndRemovals) {
  const Eigen::MatrixXd xi = body_greens(GetParam());
  const auto nodes = static_cast<Index>(xi.rows() / GetParam());
  Capacitance capacitance(xi, GetParam(), 48);
  std::mt19937 random(2);
  const auto draw = [&random](Index below) {
    return std::uniform_int_distribution<Index>(0, below - 1)(random);
  };
  for (int change = 0; change < 1000; ++change) {
    const auto m = static_cast<Index>(capacitance.nodes_.size());
    const bool grow = m == 0 || (m < 48 && draw(2) == 0);
    if (grow) {
      Index node = draw(nodes);
      while (std::find(capacitance.nodes_.begin(), capacitance.nodes_.end(), node) !=
             capacitance.nodes_.end()) {
        node = draw(nodes);
      }
      ASSERT_EQ(capacitance.add(node), CapacitanceStatus::ok) << change;
    } else {
      capacitance.remove(draw(m));
    }
    if (change % 50 == 49) {
      ASSERT_LT(capacitance.error(), 1e-8) << change;
    }
  }
}

RC_GTEST_PROP(CapacitanceMatrix, AnySequenceOfChangesKeepsTheFactor,
              (const std::vector<std::uint8_t>& changes)) {
  const int dimension = *rc::gen::inRange(1, 4);
  static const std::array<Eigen::MatrixXd, 3> greens = {random_greens(1, 12), random_greens(2, 12),
                                                        random_greens(3, 12)};
  Capacitance capacitance(greens[static_cast<std::size_t>(dimension - 1)], dimension, 12);
  for (const std::uint8_t change : changes) {
    const Index node = change % 12;
    const auto found = std::find(capacitance.nodes_.begin(), capacitance.nodes_.end(), node);
    if (found == capacitance.nodes_.end()) {
      RC_ASSERT(capacitance.add(node) == CapacitanceStatus::ok);
    } else {
      capacitance.remove(static_cast<Index>(found - capacitance.nodes_.begin()));
    }
  }
  RC_ASSERT(capacitance.error() < 1e-12);
}

TEST_P(CapacitanceMatrices, RefusesWhatDoesNotFitAndStaysAsItWas) {
  const Eigen::MatrixXd xi = random_greens(GetParam(), 5);
  Capacitance capacitance(xi, GetParam(), 3);
  ASSERT_EQ(capacitance.add(0), CapacitanceStatus::ok);
  EXPECT_EQ(capacitance.add(0), CapacitanceStatus::not_positive_definite) << "a node held twice";
  const auto d = static_cast<std::size_t>(GetParam());
  const std::vector<double> nonsense(2 * d * d, std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(capacitance.C_.add(nonsense), CapacitanceStatus::not_positive_definite);
  ASSERT_EQ(capacitance.add(1), CapacitanceStatus::ok);
  ASSERT_EQ(capacitance.add(2), CapacitanceStatus::ok);
  EXPECT_EQ(capacitance.add(3), CapacitanceStatus::full);
  EXPECT_EQ(capacitance.C_.nodes(), 3);
  EXPECT_LT(capacitance.error(), 1e-14);
}

// A second node that is all but glued to the first: with one dof a node its pivot is what is on top of
// theirs.
TEST(CapacitanceMatrix, TakesOnlyPivotsAboveItsTolerance) {
  for (const double share : {0.5, 2.0}) {
    Eigen::MatrixXd xi = Eigen::MatrixXd::Ones(2, 2);
    xi(1, 1) += share * CapacitanceMatrix::pivot_tolerance;
    Capacitance capacitance(xi, 1, 2);
    ASSERT_EQ(capacitance.add(0), CapacitanceStatus::ok);
    EXPECT_EQ(capacitance.add(1),
              share > 1.0 ? CapacitanceStatus::ok : CapacitanceStatus::not_positive_definite);
  }
}

TEST(CapacitanceMatrix, RefusesToBeBuiltWithoutRoom) {
  for (const int dimension : {1, 2, 3}) {
    for (const Index room : {0, -1}) {
      try {
        const CapacitanceMatrix C(dimension, room);
        FAIL() << "no room was taken";
      } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("room for " + std::to_string(room) + " "), std::string::npos)
            << error.what();
      }
    }
  }
}

TEST(CapacitanceMatrix, RefusesAnotherDimension) {
  for (const int dimension : {-1, 0, 4}) {
    try {
      const CapacitanceMatrix C(dimension, 5);
      FAIL() << dimension << " dofs a node were taken";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("nodes of " + std::to_string(dimension) + " dofs"),
                std::string::npos)
          << error.what();
    }
  }
}

}  // namespace
}  // namespace palpate::capacitance_test
