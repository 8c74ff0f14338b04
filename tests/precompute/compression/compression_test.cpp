// Compressed Green's functions, written out, against the dense inverse of K; and what is certified of them.
#include "precompute/compression/compression.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "base/error.h"
#include "meshes/generate.h"
#include "precompute/compression/certificate.h"
#include "precompute/compression/recompression.h"
#include "precompute/numerics/touches.h"
#include "tests/support/compression/hierarchical_sample.h"
#include "tests/support/compression/inverted_body.h"

namespace palpate::compression_test {
namespace {

struct CompressionOptions {
  double cut = 1e-2;
  int jobs = 1;
  std::int64_t forward_bytes = 1 << 28;
};

std::optional<HierarchicalMatrix> compress(const Factor& factor, std::span<const std::int64_t> stored_dofs,
                                           int dimension, const ClusteredNodes& nodes,
                                           const CompressionOptions& options, CompressionProgress progress) {
  ThreadSharing threads(options.jobs);
  Compression compression(factor, stored_dofs, dimension, nodes, threads, options.forward_bytes,
                          std::move(progress));
  if (!compression.prepare()) return std::nullopt;
  const std::shared_ptr<HierarchicalMatrix> matrix = compression.compress(options.cut);
  return matrix == nullptr ? std::nullopt : std::optional(*matrix);
}

const Material soft{1.0e4, 0.45, 1000.0};

bool go_on(CompressionStage, double) {
  return true;
}

/// A body, and what compresses its Green's functions and certifies them.
class Body : public test::InvertedBody {
 public:
  using InvertedBody::InvertedBody;

  [[nodiscard]] HierarchicalMatrix compressed(const CompressionOptions& options) const {
    return compress(factor(), stored().dofs, dimension(), stored().clusters, options, go_on).value();
  }
  [[nodiscard]] std::vector<TouchErrors> certified(const HierarchicalMatrix& matrix,
                                                   std::span<const Index> touchable, std::int64_t touches,
                                                   int jobs = 1) const {
    ThreadSharing threads(jobs);
    return certify(matrix, factor(), stored().dofs, stored().points, touchable, touches, 0, threads,
                   [](double) { return true; });
  }
};

bool at_bottom(const Vec3& x) {
  return x.z() < 1e-9;
}
bool at_left(const Vec3& x) {
  return x.x() < 1e-9;
}

test::ElasticCase bar(ElementType element = ElementType::tet4) {
  return {generate(BoxShape{Vec3::Zero(), Vec3(0.2, 0.06, 0.05), {16, 5, 4}}, element), soft};
}

const Body& clamped_bar() {
  static const Body body(bar().hold(at_left, 7));
  return body;
}

/// On rollers: stored nodes have dofs that are held.
const Body& bar_on_rollers() {
  static const Body body(bar().hold(at_bottom, 4).hold(at_left, 3));
  return body;
}

/// With so many leaves that several are solved for together.
const Body& bar_of_small_leaves() {
  static const Body body(bar().hold(at_left, 7), {.leaf = 2});
  return body;
}

const Body& plate() {
  static const Body body(
      test::ElasticCase(
          generate(RectangleShape{Vec3::Zero(), Vec3(1.0, 0.5, 0.0), {36, 18}}, ElementType::tri3), soft)
          .hold([](const Vec3& x) { return x.y() < 1e-9; }, 3),
      {.leaf = 12}, Scope::full);
  return body;
}

/// The largest norm of a row of D^-1/2 (stored - exact) D^-1/2, D the diagonal of Xi [-].
double worst_row(const Body& body, const Eigen::MatrixXd& stored) {
  Eigen::VectorXd root = body.Xi().diagonal().cwiseSqrt();
  for (double& r : root) r = r > 0.0 ? 1.0 / r : 0.0;
  const Eigen::MatrixXd error = root.asDiagonal() * (stored - body.Xi()) * root.asDiagonal();
  return error.rowwise().norm().maxCoeff();
}

void expect_near_entries(const Body& body, const HierarchicalMatrix& matrix) {
  const std::int64_t d = matrix.dimension;
  // What cancels in a solve is in proportion to the largest entries, not to the own one.
  const double rounding = 1e-12 * body.Xi().cwiseAbs().maxCoeff();
  for (std::size_t p = 0; p < matrix.near_pair.size(); ++p) {
    const auto [row, column] = matrix.near_pair[p];
    const float* entry = matrix.near.get() + matrix.near_at[p];
    for (std::int64_t i = d * matrix.tree.begin(row); i < d * matrix.tree.end(row); ++i) {
      for (std::int64_t j = d * matrix.tree.begin(column); j < d * matrix.tree.end(column); ++j) {
        const double exact = body.Xi()(i, j);
        ASSERT_NEAR(double{*entry++}, exact, 6.1e-8 * std::abs(exact) + rounding) << i << ", " << j;
      }
    }
  }
}

/// Near entries are rounded, far ones as exact as the cut says, and the better the smaller it is.
void expect_compressed(const Body& body, double finest = 1e-5) {
  ASSERT_GT(body.stored().clusters.far_pair.size(), 20U);
  double last = std::numeric_limits<double>::infinity();
  for (double cut = 1e-1; cut > 0.5 * finest; cut *= 0.1) {
    const HierarchicalMatrix matrix = body.compressed({.cut = cut});
    expect_near_entries(body, matrix);
    const double error = worst_row(body, test::written_out(matrix));
    EXPECT_LT(error, 8.0 * cut) << cut;
    EXPECT_LT(error, 0.5 * last) << cut;
    last = error;
  }
}

TEST(Compression, OfABarEqualsTheInverseWithinTheCut) {
  expect_compressed(clamped_bar());
}

TEST(Compression, OfAPlateEqualsTheInverseWithinTheCut) {
  expect_compressed(plate());
}

TEST(Compression, OfNodesHeldAlongSomeAxes) {
  const auto& dofs = bar_on_rollers().stored().dofs;
  ASSERT_GT(std::count(dofs.begin(), dofs.end(), -1), 20);
  expect_compressed(bar_on_rollers());
  const Eigen::MatrixXd stored = test::written_out(bar_on_rollers().compressed({}));
  for (Eigen::Index i = 0; i < stored.rows(); ++i) {
    if (dofs[static_cast<std::size_t>(i)] >= 0) continue;
    EXPECT_EQ(stored.row(i).cwiseAbs().maxCoeff(), 0.0) << i;
    EXPECT_EQ(stored.col(i).cwiseAbs().maxCoeff(), 0.0) << i;
  }
}

// Nothing is far of importance between the parts: ranks are zero, up to clusters whose children have none.
TEST(Compression, OfABodyCutInTwoByAClampedSlice) {
  const Body body(test::ElasticCase(generate(BoxShape{Vec3::Zero(), Vec3(0.2, 0.02, 0.02), {40, 4, 4}}), soft)
                      .hold([](const Vec3& x) { return std::abs(x.x() - 0.1) < 0.0301; }, 7),
                  {.leaf = 8});
  const HierarchicalMatrix coarse = body.compressed({.cut = 0.5});
  EXPECT_LT(worst_row(body, test::written_out(coarse)), 4.0);
  expect_near_entries(body, coarse);
  const HierarchicalMatrix fine = body.compressed({.cut = 1e-4});
  EXPECT_LT(worst_row(body, test::written_out(fine)), 8e-4);
}

// A cut that leaves nothing: what is far is zero.
TEST(Compression, OfRankZero) {
  const HierarchicalMatrix matrix = clamped_bar().compressed({.cut = 1e6});
  EXPECT_EQ(*std::max_element(matrix.rank.begin(), matrix.rank.end()), 0);
  expect_near_entries(clamped_bar(), matrix);
  EXPECT_TRUE(test::written_out(matrix).allFinite());
}

TEST(Compression, OfOneLeafIsTheInverse) {
  const Body body(bar().hold(at_left, 7), {.leaf = 10000});
  const HierarchicalMatrix matrix = body.compressed({});
  ASSERT_EQ(matrix.tree.levels, 0);
  EXPECT_LT((test::written_out(matrix) - body.Xi()).cwiseAbs().maxCoeff(), 6.1e-8 * body.Xi().maxCoeff());
}

// Far stiffer than tissue: what is stored keeps its digits.
TEST(Compression, DoesNotDependOnTheUnitOfStiffness) {
  test::ElasticCase stiff = bar().hold(at_left, 7);
  stiff.materials = {{1.0e4 * 0x1p40, 0.45, 1000.0}};
  const HierarchicalMatrix a = clamped_bar().compressed({.cut = 1e-3}),
                           b = Body(std::move(stiff), {.leaf = 12}).compressed({.cut = 1e-3});
  EXPECT_EQ(a.rank, b.rank);
  const Eigen::MatrixXd soft_Xi = test::written_out(a), stiff_Xi = 0x1p40 * test::written_out(b);
  EXPECT_LT((soft_Xi - stiff_Xi).cwiseAbs().maxCoeff(), 1e-6 * soft_Xi.cwiseAbs().maxCoeff());
}

bool equal(const std::shared_ptr<const float[]>& a, const std::shared_ptr<const float[]>& b,
           std::int64_t count) {
  return std::memcmp(a.get(), b.get(), static_cast<std::size_t>(count) * sizeof(float)) == 0;
}

TEST(Compression, DoesNotDependOnJobsOrMemory) {
  for (const Body* body : {&clamped_bar(), &plate(), &bar_of_small_leaves()}) {
    const HierarchicalMatrix one = body->compressed({.cut = 1e-3});
    for (const auto& [jobs, forward_bytes] :
         {std::pair(2, 1 << 28), std::pair(3, 1 << 28), std::pair(3, 1 << 16), std::pair(1, 0)}) {
      const HierarchicalMatrix more =
          body->compressed({.cut = 1e-3, .jobs = jobs, .forward_bytes = forward_bytes});
      ASSERT_EQ(one.rank, more.rank);
      EXPECT_TRUE(equal(one.basis, more.basis, one.basis_at.back()));
      EXPECT_TRUE(equal(one.transfer, more.transfer, one.transfer_at.back()));
      EXPECT_TRUE(equal(one.coupling, more.coupling, one.coupling_at.back()));
      EXPECT_TRUE(equal(one.near, more.near, one.near_at.back()));
    }
  }
}

TEST(Compression, OfClustersSolvedForTogether) {
  const Body& body = bar_of_small_leaves();
  ASSERT_GT(clusters_together(body.stored().clusters.tree.levels), 1);
  expect_compressed(body);
}

TEST(Compression, TellsOfItsProgressInOrder) {
  CompressionStage stage = CompressionStage::near;
  double share = 0.0;
  std::vector<double> ends;
  const Body& body = clamped_bar();
  compress(body.factor(), body.stored().dofs, 3, body.stored().clusters, {.jobs = 3},
           [&](CompressionStage now, double done) {
             if (now != stage) {
               ends.push_back(share);
               share = 0.0;
             }
             EXPECT_GE(now, stage);
             EXPECT_GT(done, share);
             stage = now;
             share = done;
             return true;
           });
  ends.push_back(share);
  EXPECT_EQ(ends, (std::vector<double>{1.0, 1.0, 1.0}));
}

TEST(Compression, StopsInEveryStage) {
  const Body& body = clamped_bar();
  for (const CompressionStage last :
       {CompressionStage::near, CompressionStage::samples, CompressionStage::far}) {
    for (const double share : {0.0, 0.5}) {
      for (const int jobs : {1, 3}) {
        int after = 0;
        bool stopped = false;
        const auto matrix = compress(body.factor(), body.stored().dofs, 3, body.stored().clusters,
                                     {.jobs = jobs}, [&](CompressionStage stage, double done) {
                                       after += stopped ? 1 : 0;
                                       stopped = stopped || (stage == last && done > share);
                                       return !stopped;
                                     });
        EXPECT_FALSE(matrix.has_value());
        EXPECT_TRUE(stopped);
        EXPECT_LT(after, jobs) << "more than what was under way";
      }
    }
  }
}

// Four leaves in a row that are far from each other but for neighbours: a skeleton of all 24 dofs of a leaf
// is exact, however small the cut.
TEST(Compression, OfFullRankIsTheInverse) {
  const Body body(
      test::ElasticCase(generate(BoxShape{Vec3::Zero(), Vec3(0.2, 0.005, 0.005), {8, 1, 1}}), soft)
          .hold(at_left, 7),
      {.leaf = 8, .eta = 1.0});
  ASSERT_EQ(body.stored().clusters.far_pair.size(), 3U);
  const HierarchicalMatrix matrix = body.compressed({.cut = 1e-30});
  EXPECT_GE(*std::max_element(matrix.rank.begin(), matrix.rank.end()), 18) << "of 24 dofs";
  EXPECT_LT(worst_row(body, test::written_out(matrix)), 1e-6);
}

/// L^-1 (Xi - stored) L^-T with the roots L of the leaves.
Eigen::MatrixXd weighed_error(const Body& body, const HierarchicalMatrix& matrix) {
  Eigen::MatrixXd error = body.Xi() - test::written_out(matrix);
  for (Index leaf = 0; leaf < matrix.tree.leaves(); ++leaf) {
    const Index c = matrix.tree.first_leaf() + leaf;
    const Eigen::Index first = matrix.dimension * matrix.tree.begin(c),
                       n = matrix.dimension * matrix.tree.end(c) - first;
    const Eigen::MatrixXd Xi = body.Xi().block(first, first, n, n), L = root_of_leaf(matrix, leaf);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j)
        EXPECT_NEAR((L * L.transpose())(i, j), Xi(i, j) == 0.0 && i == j ? 1.0 : Xi(i, j),
                    1e-6 * Xi.cwiseAbs().maxCoeff());
    }
    const auto lower = L.triangularView<Eigen::Lower>();
    error.middleRows(first, n) = lower.solve(Eigen::MatrixXd(error.middleRows(first, n)));
    error.middleCols(first, n) =
        lower.solve(Eigen::MatrixXd(error.middleCols(first, n).transpose())).transpose();
  }
  return error;
}

// All together they are what random loads tell of it; each alone is off where its skeletons are better or
// worse than others are.
TEST(Compression, ErrorsOfThePairsAreThoseOfTheInverse) {
  for (const Body* body : {&clamped_bar(), &bar_on_rollers(), &plate()}) {
    for (const double cut : {1e-1, 1e-2, 1e-3}) {
      const HierarchicalMatrix matrix = body->compressed({.cut = cut});
      ASSERT_EQ(matrix.pair_error.size(), matrix.far_pair.size());
      const Eigen::MatrixXd error = weighed_error(*body, matrix);
      double all = 0.0, exact = 0.0;
      for (std::size_t p = 0; p < matrix.far_pair.size(); ++p) {
        const auto [a, b] = matrix.far_pair[p];
        const auto first = [&](Index c) { return Eigen::Index{matrix.dimension} * matrix.tree.begin(c); };
        const auto dofs = [&](Index c) {
          return matrix.dimension * (matrix.tree.end(c) - matrix.tree.begin(c));
        };
        const double of_pair = error.block(first(a), first(b), dofs(a), dofs(b)).norm();
        EXPECT_LT(of_pair, 3.0 * matrix.pair_error[p] + 1e-6) << p << " at a cut of " << cut;
        all += matrix.pair_error[p] * matrix.pair_error[p];
        exact += of_pair * of_pair;
      }
      EXPECT_NEAR(std::sqrt(all), std::sqrt(exact), 0.2 * std::sqrt(exact)) << cut;
      EXPECT_LT(error.rowwise().norm().maxCoeff(), 3.0 * cut) << cut;
    }
  }
}

TEST(Compression, RefusesMoreTermsThanThereIsRoomFor) {
  try {
    static_cast<void>(clamped_bar().compressed({.cut = 1e-9}));
    FAIL() << "more terms are needed than a tick has room for";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("terms"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.hint()).find("tolerance"), std::string::npos) << error.hint();
  }
  EXPECT_THROW(static_cast<void>(clamped_bar().compressed({.cut = 1e-9, .jobs = 3})), Error);
}

// --- touches and certificate ---

// The forces of C^-1 u by the inverse, node by node.
TEST(Touches, ErrorIsThatOfTheLargestForce) {
  std::mt19937_64 random(3);
  for (const int d : {2, 3}) {
    const Eigen::Index n = 5 * d;
    const auto symmetric = [&](double size) {
      const Eigen::MatrixXd A = Eigen::MatrixXd::NullaryExpr(n, n, [&] { return size * uniform(random); });
      return Eigen::MatrixXd(A + A.transpose());
    };
    const Eigen::MatrixXd exact =
                              3.0 * static_cast<double>(n) * Eigen::MatrixXd::Identity(n, n) + symmetric(1.0),
                          C = exact + symmetric(1e-3);
    const Eigen::MatrixXd u = Eigen::MatrixXd::NullaryExpr(n, 4, [&] { return uniform(random); });
    const Eigen::MatrixXd f = C.inverse() * u, f_0 = exact.inverse() * u;
    double worst = 0.0;
    for (Eigen::Index k = 0; k < 4; ++k) {
      double difference = 0.0, largest = 0.0;
      for (Eigen::Index node = 0; node < 5; ++node) {
        difference = std::max(difference, (f - f_0).col(k).segment(d * node, d).norm());
        largest = std::max(largest, f_0.col(k).segment(d * node, d).norm());
      }
      worst = std::max(worst, difference / largest);
    }
    EXPECT_NEAR(touch_error(exact.cast<long double>(), C, u, d), worst, 1e-9 * worst);
    EXPECT_EQ(touch_error(exact.cast<long double>(), -C, u, d), std::numeric_limits<double>::infinity());
    // Fewer nodes: the first ones of both matrices.
    const Eigen::MatrixXd first = u.topRows(2 * d);
    EXPECT_DOUBLE_EQ(touch_error(exact.cast<long double>(), C, first, d),
                     touch_error(exact.topLeftCorner(2 * d, 2 * d).cast<long double>(),
                                 C.topLeftCorner(2 * d, 2 * d), first, d));
  }
}

// Of a matrix whose condition is 1e10 a factor in double precision has forces some 1e-6 off: the reference,
// which is refined, tells so as a factor in extended precision does.
TEST(Touches, ReferenceIsRightBeyondDoublePrecision) {
  using Extended = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  std::mt19937_64 random(5);
  const int d = 3, n = 5 * d;
  const Eigen::MatrixXd Q =
      Eigen::MatrixXd::NullaryExpr(n, n, [&] { return uniform(random); }).householderQr().householderQ();
  const Eigen::VectorXd scales =
      Eigen::VectorXd::LinSpaced(n, 0.0, -10.0).unaryExpr([](double x) { return std::pow(10.0, x); });
  Eigen::MatrixXd C = Q * scales.asDiagonal() * Q.transpose();
  C = (0.5 * (C + C.transpose())).eval();
  const Eigen::MatrixXd u = Eigen::MatrixXd::NullaryExpr(n, 2, [&] { return uniform(random); });
  const Extended f = C.llt().solve(u).cast<long double>(),
                 f_0 = C.cast<long double>().llt().solve(u.cast<long double>());
  double worst = 0.0;
  for (Eigen::Index k = 0; k < 2; ++k) {
    long double difference = 0.0L, largest = 0.0L;
    for (Eigen::Index node = 0; node < n / d; ++node) {
      difference = std::max(difference, (f - f_0).col(k).segment(d * node, d).norm());
      largest = std::max(largest, f_0.col(k).segment(d * node, d).norm());
    }
    worst = std::max(worst, static_cast<double>(difference / largest));
  }
  EXPECT_GT(worst, 1e-9);
  EXPECT_NEAR(touch_error(C.cast<long double>(), C, u, d), worst, 0.01 * worst);
}

TEST(Touches, DisplacementsAreAlongAxesLinearAndRandom) {
  for (const int d : {2, 3}) {
    std::mt19937_64 random(4);
    const std::vector<Vec3> arms = {Vec3::Zero(), Vec3(0.01, 0.0, 0.0), Vec3(0.02, 0.0, 0.0),
                                    Vec3(0.0, 0.01, 0.0)};
    const Eigen::MatrixXd u = touch_displacements(arms, d, random);
    ASSERT_EQ(u.rows(), 4 * d);
    ASSERT_EQ(u.cols(), d + 3);
    for (int axis = 0; axis < d; ++axis)
      for (Eigen::Index i = 0; i < u.rows(); ++i) EXPECT_EQ(u(i, axis), i % d == axis ? 1.0 : 0.0);
    const auto at = [&](Eigen::Index node) { return u.col(d).segment(d * node, d); };
    EXPECT_LT((at(2) - at(1) - (at(1) - at(0))).norm(), 1e-14);
    EXPECT_GT((at(1) - at(0)).norm(), 0.0);
    EXPECT_NE(u.col(d + 1), u.col(d + 2));
    EXPECT_LE(u.cwiseAbs().maxCoeff(), 4.0);
  }
}

// A matrix that is 1 % too soft makes every force 1 % too small.
TEST(Certificate, OfAScaledMatrixIsTheScale) {
  for (const Body* body : {&clamped_bar(), &plate(), &bar_on_rollers()}) {
    HierarchicalMatrix matrix = body->compressed({.cut = 1e-6});
    for (const double scale : {1.01, 0.5}) {
      matrix.scale = scale;
      for (const TouchErrors& of_count : body->certified(matrix, body->stored().touchable, 6)) {
        ASSERT_EQ(of_count.errors.size(), 6U);
        for (const double error : of_count.errors)
          EXPECT_NEAR(error, std::abs(1.0 / scale - 1.0), 2e-3) << of_count.nodes;
      }
    }
    matrix.scale = -1.0;
    for (const TouchErrors& of_count : body->certified(matrix, body->stored().touchable, 3))
      EXPECT_EQ(of_count.quantile(0.0), std::numeric_limits<double>::infinity());
  }
}

// With one node to touch, what is touched is known: blocks of the matrix written out and of the inverse.
TEST(Certificate, OfOneNodeByDenseAlgebra) {
  const Body& body = clamped_bar();
  const HierarchicalMatrix matrix = body.compressed({.cut = 0.3});
  Eigen::MatrixXd stored = test::written_out(matrix);
  const Index node = body.stored().touchable[body.stored().touchable.size() / 2];
  HierarchicalMatrix soft_one = matrix;
  soft_one.scale = 1.25;
  stored *= 1.25;
  constexpr std::int64_t touches = 4;
  const auto errors = body.certified(soft_one, {&node, 1}, touches);
  ASSERT_EQ(errors.size(), certified_nodes.size());
  for (std::size_t count = 0; count < errors.size(); ++count) {
    EXPECT_EQ(errors[count].nodes, certified_nodes[count]);
    std::vector<double> expected;
    for (std::int64_t k = 0; k < touches; ++k) {
      std::mt19937_64 random(static_cast<std::uint64_t>(k * std::ssize(errors)) + count);
      random();  // the choice of the node
      const Eigen::MatrixXd u = touch_displacements(std::vector<Vec3>(1, Vec3::Zero()), 3, random);
      const Eigen::MatrixXd f = stored.block<3, 3>(3 * node, 3 * node).inverse() * u,
                            f_0 = body.Xi().block<3, 3>(3 * node, 3 * node).inverse() * u;
      expected.push_back(((f - f_0).colwise().norm().array() / f_0.colwise().norm().array()).maxCoeff());
    }
    std::sort(expected.begin(), expected.end());
    for (std::size_t k = 0; k < expected.size(); ++k)
      EXPECT_NEAR(errors[count].errors.at(k), expected[k], 1e-6) << certified_nodes[count];
  }
}

// All nodes of a patch: bounds by the matrices alone. f - f_0 = (C^-1 - C_0^-1) u.
TEST(Certificate, OfManyNodesIsWithinItsBounds) {
  const Body& body = plate();
  const HierarchicalMatrix matrix = body.compressed({.cut = 1e-2});
  const Eigen::MatrixXd stored = test::written_out(matrix);
  std::vector<Index> touchable(body.stored().touchable.begin(), body.stored().touchable.begin() + 5);
  Eigen::MatrixXd C(10, 10), exact(10, 10);
  for (Eigen::Index i = 0; i < 5; ++i) {
    for (Eigen::Index j = 0; j < 5; ++j) {
      const Eigen::Index a = 2 * touchable[std::size_t(i)], b = 2 * touchable[std::size_t(j)];
      C.block<2, 2>(2 * i, 2 * j) = stored.block<2, 2>(a, b);
      exact.block<2, 2>(2 * i, 2 * j) = body.Xi().block<2, 2>(a, b);
    }
  }
  // The displacements along the axes are among those of each touch.
  double least = 0.0;
  const Eigen::MatrixXd difference = C.inverse() - exact.inverse();
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    const Eigen::VectorXd u =
        Eigen::VectorXd::NullaryExpr(10, [&](Eigen::Index i) { return i % 2 == axis ? 1.0 : 0.0; });
    const Eigen::VectorXd f = difference * u, f_0 = exact.inverse() * u;
    least = std::max(
        least, f.reshaped(2, 5).colwise().norm().maxCoeff() / f_0.reshaped(2, 5).colwise().norm().maxCoeff());
  }
  const double most = std::sqrt(5.0) * (difference * exact).norm();
  for (const TouchErrors& of_count : body.certified(matrix, touchable, 9)) {
    if (of_count.nodes < 5) continue;
    EXPECT_GE(of_count.errors.front(), 0.999 * least) << of_count.nodes;
    EXPECT_LE(of_count.errors.back(), 1.001 * most) << of_count.nodes;
  }
}

TEST(Certificate, DoesNotDependOnTheNumberOfJobsAndFallsWithTheCut) {
  const Body& body = plate();
  const HierarchicalMatrix coarse = body.compressed({.cut = 3e-2}), fine = body.compressed({.cut = 1e-5});
  const auto errors = body.certified(coarse, body.stored().touchable, 12),
             finer = body.certified(fine, body.stored().touchable, 12),
             again = body.certified(coarse, body.stored().touchable, 12, 3);
  for (std::size_t k = 0; k < errors.size(); ++k) {
    EXPECT_EQ(errors[k].errors, again[k].errors);
    EXPECT_TRUE(std::is_sorted(errors[k].errors.begin(), errors[k].errors.end()));
    EXPECT_LE(finer[k].errors.back(), errors[k].errors.back());
  }
  EXPECT_LT(finer.back().errors.back(), 0.1 * errors.back().errors.back());
}

TEST(Certificate, QuantilesAreThoseOfTheSortedErrors) {
  const TouchErrors errors{5, {1.0, 2.0, 3.0, 4.0, 5.0}};
  EXPECT_EQ(errors.quantile(0.0), 1.0);
  EXPECT_EQ(errors.quantile(0.5), 3.0);
  EXPECT_EQ(errors.quantile(0.99), 4.0);
  EXPECT_EQ(errors.quantile(1.0), 5.0);
  EXPECT_EQ(TouchErrors{}.quantile(0.5), 0.0);
}

TEST(Certificate, WithNothingToTouchOrWhereItIsStopped) {
  const Body& body = clamped_bar();
  const HierarchicalMatrix matrix = body.compressed({});
  for (const TouchErrors& of_count : body.certified(matrix, {}, 5)) EXPECT_TRUE(of_count.errors.empty());
  ThreadSharing one(1);
  int done = 0;
  std::size_t measured = 0;
  for (const TouchErrors& of_count :
       certify(matrix, body.factor(), body.stored().dofs, body.stored().points, body.stored().touchable, 100,
               0, one, [&](double) { return ++done < 6; }))
    measured += of_count.errors.size();
  EXPECT_EQ(measured, 6U * certified_nodes.size());
}

}  // namespace
}  // namespace palpate::compression_test
