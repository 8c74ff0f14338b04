// The factor that grows and shrinks against Eigen's, computed afresh.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <random>

#include "meshes/error.h"
#include "runtime/capacitance.h"
#include "runtime/greens.h"
#include "tests/runtime_model.h"

namespace palpate {
namespace {

/// C and its nodes, grown and shrunk together.
class Capacitance {
 public:
  Capacitance(const Greens& xi, Index max_nodes) : xi_(&xi), C_(xi.dimension(), max_nodes) {}

  CapacitanceStatus add(Index node) {
    std::vector<Index> columns = nodes_;
    columns.push_back(node);
    std::vector<double> blocks(static_cast<std::size_t>(xi_->dimension() * xi_->dimension()) *
                               columns.size());
    xi_->gather(node, columns, blocks);
    const CapacitanceStatus status = C_.add(blocks);
    if (status == CapacitanceStatus::ok) nodes_ = columns;
    return status;
  }

  void remove(Index k) {
    C_.remove(k);
    nodes_.erase(nodes_.begin() + k);
  }

  [[nodiscard]] Eigen::MatrixXd fresh() const {
    const auto m = static_cast<Eigen::Index>(nodes_.size());
    const Eigen::Index d = xi_->dimension();
    Eigen::MatrixXd C(d * m, d * m);
    for (Eigen::Index a = 0; a < m; ++a) {
      for (Eigen::Index b = 0; b < m; ++b) {
        C.block(d * a, d * b, d, d) =
            xi_->block(nodes_[static_cast<std::size_t>(a)], nodes_[static_cast<std::size_t>(b)]);
      }
    }
    return C;
  }

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

  const Greens* xi_;
  CapacitanceMatrix C_;
  std::vector<Index> nodes_;
};

Greens random_greens(int dimension, Eigen::Index nodes) {
  return Greens(test::pack(test::random_definite(dimension * nodes, 5), Precision::double_precision),
                dimension);
}

/// With two and with three dofs a node.
class CapacitanceMatrices : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Dimension, CapacitanceMatrices, testing::Values(2, 3));

TEST_P(CapacitanceMatrices, FactorIsThatOfAFreshFactorisation) {
  const Greens xi = random_greens(GetParam(), 60);
  Capacitance capacitance(xi, 60);
  for (Index node = 59; node >= 0; --node) ASSERT_EQ(capacitance.add(node), CapacitanceStatus::ok);
  EXPECT_EQ(capacitance.C_.nodes(), 60);
  EXPECT_LT(capacitance.error(), 1e-13);
}

TEST_P(CapacitanceMatrices, SolveInvertsC) {
  const Greens xi = random_greens(GetParam(), 45);
  Capacitance capacitance(xi, 64);
  for (Index node = 0; node < 45; ++node) ASSERT_EQ(capacitance.add(node), CapacitanceStatus::ok);
  const Eigen::VectorXd u = Eigen::VectorXd::LinSpaced(GetParam() * 45, -1.0, 2.0);
  Eigen::VectorXd f = u;
  capacitance.C_.solve({f.data(), static_cast<std::size_t>(f.size())});
  EXPECT_LT((capacitance.fresh() * f - u).norm(), 1e-12 * u.norm());
}

TEST_P(CapacitanceMatrices, RemovesFirstMiddleAndLast) {
  const Greens xi = random_greens(GetParam(), 20);
  for (const Index k : {0, 9, 19}) {
    Capacitance capacitance(xi, 20);
    for (Index node = 0; node < 20; ++node) ASSERT_EQ(capacitance.add(node), CapacitanceStatus::ok);
    capacitance.remove(k);
    EXPECT_LT(capacitance.error(), 1e-13) << k;
  }
}

// The Green's functions of a real body, much worse conditioned than random matrices, through 1000 changes.
TEST_P(CapacitanceMatrices, AgreesAfterAThousandRandomAdditionsAndRemovals) {
  const Model model =
      test::unit_model(GetParam(), GetParam() == 3 ? 5 : 20, Scope::surface, Precision::double_precision);
  const Greens xi(model.greens, model.dimension());
  Capacitance capacitance(xi, 48);
  std::mt19937 random(2);
  const auto draw = [&random](Index below) {
    return std::uniform_int_distribution<Index>(0, below - 1)(random);
  };
  for (int change = 0; change < 1000; ++change) {
    const auto m = static_cast<Index>(capacitance.nodes_.size());
    const bool grow = m == 0 || (m < 48 && draw(2) == 0);
    if (grow) {
      Index node = draw(xi.nodes());
      while (std::find(capacitance.nodes_.begin(), capacitance.nodes_.end(), node) !=
             capacitance.nodes_.end()) {
        node = draw(xi.nodes());
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
              (bool in_space, const std::vector<std::uint8_t>& changes)) {
  static const Greens plane = random_greens(2, 12);
  static const Greens space = random_greens(3, 12);
  const Greens& xi = in_space ? space : plane;
  Capacitance capacitance(xi, 12);
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
  const Greens xi = random_greens(GetParam(), 5);
  Capacitance capacitance(xi, 3);
  ASSERT_EQ(capacitance.add(0), CapacitanceStatus::ok);
  EXPECT_EQ(capacitance.add(0), CapacitanceStatus::not_positive_definite) << "a node held twice";
  const auto entries = static_cast<std::size_t>(2 * GetParam() * GetParam());
  const std::vector<double> nonsense(entries, std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(capacitance.C_.add(nonsense), CapacitanceStatus::not_positive_definite);
  ASSERT_EQ(capacitance.add(1), CapacitanceStatus::ok);
  ASSERT_EQ(capacitance.add(2), CapacitanceStatus::ok);
  EXPECT_EQ(capacitance.add(3), CapacitanceStatus::full);
  EXPECT_EQ(capacitance.C_.nodes(), 3);
  EXPECT_LT(capacitance.error(), 1e-14);
}

TEST(CapacitanceMatrix, RefusesToBeBuiltWithoutRoom) {
  EXPECT_THROW(CapacitanceMatrix(3, 0), Error);
  EXPECT_THROW(CapacitanceMatrix(2, -1), Error);
}

}  // namespace
}  // namespace palpate
