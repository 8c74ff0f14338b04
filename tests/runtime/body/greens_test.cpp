// The square, the packed and a plain matrix must say the same.
#include "runtime/body/greens.h"

#include <gtest/gtest.h>

#include <random>

#include "base/error.h"
#include "tests/support/runtime_model.h"

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
  Greens greens_{
      test::pack(xi_, GetParam().precision),
      GetParam().dimension,
      {.jobs = GetParam().jobs, .max_square_bytes = GetParam().square ? std::int64_t{1} << 32 : 0}};
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
      const Greens greens(test::pack(test::random_definite(7, 1), Precision::double_precision), dimension);
      FAIL() << "seven dofs were taken";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("7 dofs, which is not " + std::to_string(dimension)),
                std::string::npos)
          << error.what();
    }
  }
}

TEST(Greens, IsUnfoldedByDefaultWhenItIsSmall) {
  EXPECT_TRUE(Greens(test::pack(test::random_definite(30, 1), Precision::single_precision), 3).unfolded());
}

}  // namespace
}  // namespace palpate::greens_test
