// Compression from all columns, which studies compare with the product's, against the dense inverse of K.
#include "tests/support/compression/column_compression.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "meshes/generate.h"
#include "precompute/compression/compression.h"
#include "precompute/compression/recompression.h"
#include "tests/support/compression/hierarchical_sample.h"
#include "tests/support/compression/inverted_body.h"
#include "tests/support/second_routes/dense_algebra.h"

namespace palpate::column_compression_test {
namespace {

bool at_bottom(const Vec3& x) {
  return x.z() < 1e-9;
}
bool at_left(const Vec3& x) {
  return x.x() < 1e-9;
}

/// A bar on rollers, some of whose stored dofs are held, and what compresses its Green's functions.
class Bar : public test::InvertedBody {
 public:
  Bar()
      : InvertedBody(test::ElasticCase(generate(BoxShape{Vec3::Zero(), Vec3(0.2, 0.06, 0.05), {16, 5, 4}},
                                                ElementType::tet4),
                                       Material{1.0e4, 0.45, 1000.0})
                         .hold(at_bottom, 4)
                         .hold(at_left, 3)) {}

  [[nodiscard]] test::ColumnCompression compression(int jobs = 1, Index tile = 4) const {
    return {factor(), stored().dofs, 3, stored().clusters, jobs, tile};
  }

  [[nodiscard]] HierarchicalMatrix sketched(double cut) const {
    ThreadSharing one(1);
    Compression compression(factor(), stored().dofs, 3, stored().clusters, one, 1 << 28,
                            [](CompressionStage, double) { return true; });
    compression.prepare();
    return *compression.compress(cut);
  }

  /// The largest error of a force of touches of 5 to 40 nodes, over the touch's largest.
  [[nodiscard]] double force_error(const HierarchicalMatrix& matrix) const {
    const Eigen::MatrixXd compressed = test::written_out(matrix);
    std::mt19937 random(7);
    std::uniform_real_distribution<double> entry(-1.0, 1.0);
    std::vector<Index> nodes = stored().touchable;
    double worst = 0.0;
    for (int touch = 0; touch < 40; ++touch) {
      std::shuffle(nodes.begin(), nodes.end(), random);
      std::vector<Eigen::Index> dofs;
      for (int k = 0; k < (touch % 2 == 0 ? 5 : 40); ++k)
        for (int axis = 0; axis < 3; ++axis) dofs.push_back(3 * nodes[std::size_t(k)] + axis);
      const Eigen::VectorXd u = Eigen::VectorXd::NullaryExpr(std::ssize(dofs), [&] { return entry(random); });
      const Eigen::MatrixXd exact = Xi()(dofs, dofs), C = compressed(dofs, dofs);
      const Eigen::VectorXd f_0 = test::solved(exact, u), f = test::solved(C, u);
      worst = std::max(worst, (f - f_0).lpNorm<Eigen::Infinity>() / f_0.lpNorm<Eigen::Infinity>());
    }
    return worst;
  }
};

const Bar& bar() {
  static const Bar body;
  return body;
}

// What studies compare: as many bytes and as large errors as precompute's way has at the same cut.
TEST(ColumnCompression, ForcesAreThoseOfTheInverseWithinTheCut) {
  ASSERT_GT(bar().stored().clusters.far_pair.size(), 20U);
  ASSERT_GT(std::count(bar().stored().dofs.begin(), bar().stored().dofs.end(), -1), 20);
  ThreadSharing one(1);
  for (const double cut : {1e-2, 1e-3, 1e-4}) {
    const HierarchicalMatrix finer = bar().compression().compress(0.1 * cut),
                             matrix = recompressed(finer, cut, one).value(), sketched = bar().sketched(cut);
    EXPECT_LT(bar().force_error(finer), 0.5 * cut) << cut;
    const double error = bar().force_error(matrix);
    EXPECT_LT(error, 2.0 * cut) << cut;
    EXPECT_GT(error, 0.1 * cut) << cut << ": nothing was cut off";
    EXPECT_LT(error, 1.5 * bar().force_error(sketched)) << cut;
    EXPECT_LT(double(matrix.bytes()), 1.01 * double(sketched.bytes())) << cut;
  }
}

TEST(ColumnCompression, EntriesAreThoseOfTheInverse) {
  const Eigen::MatrixXd error = test::written_out(bar().compression().compress(1e-6)) - bar().Xi();
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 1e-5 * bar().Xi().maxCoeff());
  for (Eigen::Index i = 0; i < error.rows(); ++i) {
    if (bar().Xi()(i, i) > 0.0) continue;
    EXPECT_EQ(error.row(i).cwiseAbs().maxCoeff(), 0.0) << i;
  }
}

TEST(ColumnCompression, DependsOnNeitherJobsNorTiles) {
  const HierarchicalMatrix one = bar().compression().compress(1e-3);
  for (const Index tile : {1, 2, 8}) {
    const HierarchicalMatrix other = bar().compression(3, tile).compress(1e-3);
    EXPECT_EQ(other.rank, one.rank) << tile;
    EXPECT_LT((test::written_out(other) - test::written_out(one)).cwiseAbs().maxCoeff(),
              1e-6 * bar().Xi().maxCoeff())
        << tile;
  }
}

TEST(ColumnCompression, FlopsAreCountedAndTilesSampled) {
  test::ColumnCompression compression = bar().compression();
  EXPECT_GT(compression.flops(), 1e6);
  const test::ColumnTimes some = compression.estimate(1e-3, 2);
  EXPECT_GT(some.solves, 0.0);
  EXPECT_GT(some.leaves, 0.0);
}

}  // namespace
}  // namespace palpate::column_compression_test
