// The square, the packed and a plain matrix must say the same.
#include "runtime/core/body/greens.h"

#include <gtest/gtest.h>

#include <random>

#include "base/error.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/compression/hierarchical_sample.h"

namespace palpate::greens_test {
namespace {

struct Case {
  int dimension;
  Eigen::Index order;
  Precision precision;
  bool square;
  int jobs;
};

class GreensLayouts : public testing::TestWithParam<Case> {
 protected:
  Eigen::MatrixXd xi_ = test::random_definite(GetParam().order, 3);
  std::shared_ptr<const Greens> made_ = make_greens(
      test::pack(xi_, GetParam().precision), GetParam().dimension,
      {.jobs = GetParam().jobs, .max_square_bytes = GetParam().square ? std::int64_t{1} << 32 : 0});
  const Greens& greens_ = *made_;
  Eigen::Index d_ = GetParam().dimension;
  // Of W W^T, if there is any: 11 products of at most 1/4.
  double largest_smooth_ = GetParam().precision == Precision::split_precision ? 2.75 : 0.0;
  // Rounding to the stored precision, relative to the largest entry.
  double tolerance_ =
      has_float_entries(GetParam().precision) ? 6e-8 * (xi_.cwiseAbs().maxCoeff() + largest_smooth_) : 0.0;
};

TEST_P(GreensLayouts, StoreWhatTheyWereGiven) {
  EXPECT_EQ(greens_.unfolded(), GetParam().square);
  EXPECT_EQ(greens_.order(), GetParam().order);
  EXPECT_EQ(greens_.nodes(), GetParam().order / GetParam().dimension);
  const Index step = greens_.nodes() > 100 ? 37 : 1;
  for (Index a = 0; a < greens_.nodes(); a += step) {
    for (Index b = 0; b < greens_.nodes(); ++b) {
      const Eigen::MatrixXd expected = xi_.block(d_ * a, d_ * b, d_, d_);
      ASSERT_LE((greens_.block(a, b) - expected).cwiseAbs().maxCoeff(), tolerance_) << a << ", " << b;
    }
  }
}

TEST_P(GreensLayouts, GatherPutsBlocksBesideEachOther) {
  const Index last = greens_.nodes() - 1;
  const std::vector<Index> columns = {last, 0, last / 2};
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> gathered(d_, 3 * d_);
  greens_.gather(last / 3, columns, {gathered.data(), static_cast<std::size_t>(gathered.size())});
  for (std::size_t k = 0; k < columns.size(); ++k) {
    EXPECT_EQ(gathered.middleCols(d_ * static_cast<Eigen::Index>(k), d_),
              greens_.block(last / 3, columns[k]));
  }
}

TEST_P(GreensLayouts, DisplacementIsTheProduct) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> force(-1.0, 1.0);
  std::vector<Index> nodes;
  for (Index node = 0; node < greens_.nodes(); node += std::max(1, greens_.nodes() / 7))
    nodes.push_back(node);
  std::vector<double> f(static_cast<std::size_t>(d_) * nodes.size());
  for (double& value : f) value = force(random);

  Eigen::VectorXd expected = Eigen::VectorXd::Zero(xi_.rows());
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    expected += xi_.middleCols(d_ * nodes[k], d_) *
                Eigen::Map<const Eigen::VectorXd>(f.data() + static_cast<std::size_t>(d_) * k, d_);
  }
  Eigen::VectorXd u = Eigen::VectorXd::Constant(xi_.rows(), 1e30);
  greens_.displacement(nodes, f, {u.data(), static_cast<std::size_t>(u.size())});
  const double scale = xi_.cwiseAbs().maxCoeff() * static_cast<double>(f.size());
  EXPECT_LE((u - expected).cwiseAbs().maxCoeff(), tolerance_ * static_cast<double>(f.size()) + 1e-15 * scale);

  greens_.displacement({}, {}, {u.data(), static_cast<std::size_t>(u.size())});
  EXPECT_EQ(u, Eigen::VectorXd::Zero(xi_.rows()));
}

TEST_P(GreensLayouts, DisplacementOfAPartIsThatPartOfTheWhole) {
  std::mt19937 random(12);
  std::uniform_real_distribution<double> force(-1.0, 1.0);
  std::vector<Index> loaded(5);
  for (Index& node : loaded) node = std::uniform_int_distribution<Index>(0, greens_.nodes() - 1)(random);
  std::vector<double> f(static_cast<std::size_t>(d_) * loaded.size());
  for (double& value : f) value = force(random);
  Eigen::VectorXd whole(xi_.rows());
  greens_.displacement(loaded, f, {whole.data(), static_cast<std::size_t>(whole.size())});

  const double rounding = 1e-15 * xi_.cwiseAbs().maxCoeff() * static_cast<double>(f.size());
  for (int part = 0; part < 20; ++part) {
    const Index first = std::uniform_int_distribution<Index>(0, greens_.nodes() - 1)(random);
    const Index nodes = std::uniform_int_distribution<Index>(0, greens_.nodes() - first)(random);
    Eigen::VectorXd expected = Eigen::VectorXd::Constant(xi_.rows(), 7.0);
    expected.segment(d_ * first, d_ * nodes) = whole.segment(d_ * first, d_ * nodes);
    Eigen::VectorXd u = Eigen::VectorXd::Constant(xi_.rows(), 7.0);
    greens_.displacement(loaded, f, first, {u.data() + d_ * first, static_cast<std::size_t>(d_ * nodes)});
    EXPECT_LE((u - expected).cwiseAbs().maxCoeff(), rounding) << first << ", " << nodes;
  }
}

// Orders at and beside the bounds of tiles (64), cache lines and chunks of u (2048).
std::vector<Case> cases() {
  std::vector<Case> all;
  const auto add = [&all](int dimension, Eigen::Index order) {
    for (const Precision precision :
         {Precision::single_precision, Precision::split_precision, Precision::double_precision}) {
      all.push_back({dimension, order, precision, false, 1});
      all.push_back({dimension, order, precision, true, order > 100 ? 3 : 1});
    }
  };
  for (const Eigen::Index order : {2, 62, 66, 130, 192, 2050}) add(2, order);
  for (const Eigen::Index order : {3, 63, 66, 129, 192, 2049}) add(3, order);
  return all;
}

std::string case_name(const testing::TestParamInfo<Case>& info) {
  return std::to_string(info.param.dimension) + "d_" + std::to_string(info.param.order) + "_" +
         name_of(info.param.precision) + (info.param.square ? "_square" : "_packed");
}

INSTANTIATE_TEST_SUITE_P(All, GreensLayouts, testing::ValuesIn(cases()), case_name);

TEST(Greens, RefusesAnOrderThatIsNotThatOfSomeNodes) {
  for (const int dimension : {2, 3}) {
    try {
      make_greens(test::pack(test::random_definite(7, 1), Precision::double_precision), dimension);
      FAIL() << "seven dofs were taken";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("7 dofs, which is not " + std::to_string(dimension)),
                std::string::npos)
          << error.what();
    }
  }
}

TEST(Greens, IsUnfoldedByDefaultWhenItIsSmall) {
  EXPECT_TRUE(
      make_greens(test::pack(test::random_definite(30, 1), Precision::single_precision), 3)->unfolded());
}

/// Nested low-rank form beside the matrix it stands for.
class CompressedGreens : public testing::TestWithParam<int> {
 protected:
  /// Shapes of some modes of a body with as many stored dofs.
  [[nodiscard]] Modes modes() {
    Model model = test::unit_model(GetParam(), d_ == 3 ? 4 : 10, Scope::full, Precision::double_precision);
    model.stored_nodes.resize(static_cast<std::size_t>(matrix_->tree.nodes));
    model.dynamics.method = DynamicsMethod::modal;
    model.dynamics.omega = {20.0, 30.0, 50.0, 80.0};
    for (std::int64_t k = 0; k < 3 * matrix_->order(); ++k)
      model.dynamics.shapes.push_back(test::random_number(random_));
    return {model.dimension(), model.dynamics.omega, model.dynamics.shapes};
  }
  /// What every way of reading says beside a matrix.
  void expect_matrix(const Greens& greens, const Eigen::MatrixXd& xi) {
    const double tolerance = 1e-13 * xi.cwiseAbs().maxCoeff();
    const Index nodes = greens.nodes();
    for (Index a = 0; a < nodes; a += 3) {
      for (Index b = 0; b < nodes; b += 2)
        ASSERT_LE((greens.block(a, b) - xi.block(d_ * a, d_ * b, d_, d_)).cwiseAbs().maxCoeff(), tolerance);
    }
    const std::vector<Index> columns = {nodes - 1, 0, nodes / 2, 0};
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> gathered(d_, 4 * d_);
    greens.gather(nodes / 3, columns, {gathered.data(), static_cast<std::size_t>(gathered.size())});
    for (Eigen::Index k = 0; k < 4; ++k) {
      EXPECT_LE((gathered.middleCols(d_ * k, d_) -
                 xi.block(d_ * (nodes / 3), d_ * columns[static_cast<std::size_t>(k)], d_, d_))
                    .cwiseAbs()
                    .maxCoeff(),
                tolerance);
    }
    const Eigen::VectorXd f =
        Eigen::VectorXd::NullaryExpr(4 * d_, [this] { return test::random_number(random_); });
    Eigen::VectorXd expected = Eigen::VectorXd::Zero(xi.rows());
    for (Eigen::Index k = 0; k < 4; ++k)
      expected += xi.middleCols(d_ * columns[static_cast<std::size_t>(k)], d_) * f.segment(d_ * k, d_);
    const std::span<const double> forces(f.data(), static_cast<std::size_t>(f.size()));
    Eigen::VectorXd u = Eigen::VectorXd::Constant(xi.rows(), 1e30);
    greens.displacement(columns, forces, {u.data(), static_cast<std::size_t>(u.size())});
    EXPECT_LE((u - expected).cwiseAbs().maxCoeff(), 10.0 * tolerance);
    u.setConstant(7.0);
    greens.displacement(columns, forces, 5, {u.data() + 5 * d_, static_cast<std::size_t>(20 * d_)});
    expected.head(5 * d_).setConstant(7.0);
    expected.tail(xi.rows() - 25 * d_).setConstant(7.0);
    EXPECT_LE((u - expected).cwiseAbs().maxCoeff(), 10.0 * tolerance);
    greens.displacement({}, {}, {u.data(), static_cast<std::size_t>(u.size())});
    EXPECT_EQ(u, Eigen::VectorXd::Zero(xi.rows()));
  }

  Eigen::Index d_ = GetParam();
  std::mt19937_64 random_{5};
  std::shared_ptr<const HierarchicalMatrix> matrix_ = std::make_shared<const HierarchicalMatrix>(
      test::random_hierarchical({.dimension = GetParam(), .nodes = 83, .levels = 4, .scale = 0.25}, 3));
  Eigen::MatrixXd xi_ = test::written_out(*matrix_);
};

INSTANTIATE_TEST_SUITE_P(Dimension, CompressedGreens, testing::Values(2, 3));

TEST_P(CompressedGreens, AreReadAsTheMatrixTheyStandFor) {
  const std::shared_ptr<const Greens> made = make_greens(matrix_);
  const Greens& greens = *made;
  EXPECT_EQ(greens.compressed_form(), matrix_.get());
  EXPECT_FALSE(greens.unfolded());
  EXPECT_EQ(greens.order(), xi_.rows());
  EXPECT_EQ(greens.nodes(), 83);
  EXPECT_EQ(greens.dimension(), d_);
  EXPECT_EQ(greens.exact_terms(), nullptr);
  EXPECT_EQ(greens.precision(), Precision::single_precision);
  expect_matrix(greens, xi_);
}

TEST_P(CompressedGreens, TakeModesOnTop) {
  const Modes modes = this->modes();
  const std::vector<double> weights = {0.5, -0.25, 2.0};
  std::shared_ptr<const Greens> greens = with_modes(make_greens(matrix_), modes, weights);
  EXPECT_EQ(greens->exact_terms()->count, 3);
  EXPECT_EQ(greens->compressed_form(), matrix_.get());
  Eigen::MatrixXd xi = xi_;
  for (Eigen::Index i = 0; i < xi.rows(); ++i)
    for (Eigen::Index j = 0; j < xi.cols(); ++j)
      for (std::size_t k = 0; k < 3; ++k) xi(i, j) += weights[k] * modes.row(i)[k] * modes.row(j)[k];
  expect_matrix(*greens, xi);
  // A second time: both are on top.
  greens = with_modes(greens, modes, std::vector<double>{-0.5, 0.25, -2.0});
  EXPECT_EQ(greens->exact_terms()->count, 6);
  expect_matrix(*greens, xi_);
}

}  // namespace
}  // namespace palpate::greens_test
