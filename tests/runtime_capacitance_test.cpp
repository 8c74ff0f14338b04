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
  Capacitance(const Greens& xi, Index max_nodes) : xi_(&xi), C_(max_nodes) {}

  CapacitanceStatus add(Index node) {
    std::vector<Index> columns = nodes_;
    columns.push_back(node);
    std::vector<double> blocks(9 * columns.size());
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
    Eigen::MatrixXd C(3 * m, 3 * m);
    for (Eigen::Index a = 0; a < m; ++a) {
      for (Eigen::Index b = 0; b < m; ++b) {
        C.block<3, 3>(3 * a, 3 * b) =
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

Greens random_greens(Eigen::Index nodes) {
  return Greens(test::pack(test::random_definite(3 * nodes, 5), Precision::double_precision));
}

TEST(CapacitanceMatrix, FactorIsThatOfAFreshFactorisation) {
  const Greens xi = random_greens(60);
  Capacitance capacitance(xi, 60);
  for (Index node = 59; node >= 0; --node) ASSERT_EQ(capacitance.add(node), CapacitanceStatus::ok);
  EXPECT_EQ(capacitance.C_.nodes(), 60);
  EXPECT_LT(capacitance.error(), 1e-13);
}

TEST(CapacitanceMatrix, SolveInvertsC) {
  const Greens xi = random_greens(45);
  Capacitance capacitance(xi, 64);
  for (Index node = 0; node < 45; ++node) ASSERT_EQ(capacitance.add(node), CapacitanceStatus::ok);
  const Eigen::VectorXd u = Eigen::VectorXd::LinSpaced(135, -1.0, 2.0);
  Eigen::VectorXd f = u;
  capacitance.C_.solve({f.data(), 135});
  EXPECT_LT((capacitance.fresh() * f - u).norm(), 1e-12 * u.norm());
}

TEST(CapacitanceMatrix, RemovesFirstMiddleAndLast) {
  const Greens xi = random_greens(20);
  for (const Index k : {0, 9, 19}) {
    Capacitance capacitance(xi, 20);
    for (Index node = 0; node < 20; ++node) ASSERT_EQ(capacitance.add(node), CapacitanceStatus::ok);
    capacitance.remove(k);
    EXPECT_LT(capacitance.error(), 1e-13) << k;
  }
}

// The Green's functions of a real body, much worse conditioned than random matrices, through 1000 changes.
TEST(CapacitanceMatrix, AgreesAfterAThousandRandomAdditionsAndRemovals) {
  const Model model = test::box_model(5, Scope::surface, Precision::double_precision);
  const Greens xi(model.greens);
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
              (const std::vector<std::uint8_t>& changes)) {
  static const Greens xi = random_greens(12);
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

TEST(CapacitanceMatrix, RefusesWhatDoesNotFitAndStaysAsItWas) {
  const Greens xi = random_greens(5);
  Capacitance capacitance(xi, 3);
  ASSERT_EQ(capacitance.add(0), CapacitanceStatus::ok);
  EXPECT_EQ(capacitance.add(0), CapacitanceStatus::not_positive_definite) << "a node held twice";
  const std::vector<double> nonsense(18, std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(capacitance.C_.add(nonsense), CapacitanceStatus::not_positive_definite);
  ASSERT_EQ(capacitance.add(1), CapacitanceStatus::ok);
  ASSERT_EQ(capacitance.add(2), CapacitanceStatus::ok);
  EXPECT_EQ(capacitance.add(3), CapacitanceStatus::full);
  EXPECT_EQ(capacitance.C_.nodes(), 3);
  EXPECT_LT(capacitance.error(), 1e-14);
}

TEST(CapacitanceMatrix, RefusesToBeBuiltWithoutRoom) {
  EXPECT_THROW(CapacitanceMatrix(0), Error);
}

}  // namespace
}  // namespace palpate
