// The compliance close to a contact against closed forms of the half-space, and what pictures and ticks make
// of it. Forces of whole contacts: tests/programs/graded_test.py.
#include "runtime/core/body/local_compliance.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "runtime/body/body.h"
#include "runtime/core/body/free_motion.h"
#include "runtime/core/body/near_field.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate::local_compliance_test {
namespace {

using Eigen::MatrixXd;

class Local : public testing::TestWithParam<ElementType> {
 protected:
  static constexpr int cells = 5, refinement = 4;
  static constexpr double E = 1.0, nu = 0.3;  // of unit_model

  Body body_{test::unit_model(GetParam(), GetParam() == ElementType::tet10 ? 3 : cells, Scope::full,
                              Precision::double_precision),
             {},
             refinement,
             ContactModel::quasi_static,
             true};
  const LocalCompliance& local_ = *body_.local();
  Index nodes_ = static_cast<Index>(body_.surface_rest_positions().size());

  [[nodiscard]] const Vec3& at(Index node) const {
    return body_.surface_rest_positions()[static_cast<std::size_t>(node)];
  }
  [[nodiscard]] Mat3 between(Index node, Index loaded) const {
    return local_.between(local_.point(node), local_.point(loaded));
  }
  /// Surface nodes within a distance of a place.
  [[nodiscard]] std::vector<Index> around(const Vec3& place, double radius) const {
    std::vector<Index> found;
    for (Index node = 0; node < nodes_; ++node) {
      if ((at(node) - place).norm() <= radius + 1e-12) found.push_back(node);
    }
    return found;
  }
  /// Surface nodes of the top (z = 1) within a distance of its middle.
  [[nodiscard]] std::vector<Index> on_top(double radius) const { return around(Vec3(0.5, 0.5, 1.0), radius); }
  /// What is left of the half-space at a distance r.
  [[nodiscard]] double left(double r, Index a, Index b) const {
    const double q = 2.0 * r / (local_.point(a).reach + local_.point(b).reach);
    return std::pow(std::max(0.0, 1.0 - q * q), 2);
  }
  /// Compliance along each axis between nodes of the top by the images of a force in its edges: 0.75 (1 + nu)
  /// / (pi E r') by each of the two nearest edges that are not parallel, and by the image in both.
  [[nodiscard]] double by_images(Index a, Index b) const {
    const auto t = [&](Index node) {
      const double in_x = std::min(at(node).x(), 1.0 - at(node).x());
      const double in_y = std::min(at(node).y(), 1.0 - at(node).y());
      const double of_part = 0.5 * local_.point(node).disc / 2.2;
      return std::array{std::min(in_x, in_y) + of_part, std::max(in_x, in_y) + of_part};
    };
    const double far = 4.0 * t(a)[0] * t(b)[0], far_too = 4.0 * t(a)[1] * t(b)[1];
    const auto image = [&](double squared) {
      const double r = std::sqrt((at(a) - at(b)).squaredNorm() + squared);
      return left(r, a, b) / r;
    };
    return 0.75 * (1.0 + nu) / (std::numbers::pi * E) *
           (image(far) + image(far_too) + 0.75 / (1.0 - nu) * image(far + far_too));
  }
  /// N_i Xi N_j^T.
  [[nodiscard]] Mat3 of_mesh(Index i, Index j) const {
    const SurfaceParts a = body_.surface_parts(i), b = body_.surface_parts(j);
    Mat3 sum = Mat3::Zero();
    for (std::size_t k = 0; k < a.stored.size(); ++k) {
      for (std::size_t l = 0; l < b.stored.size(); ++l)
        sum += a.weights[k] * b.weights[l] * Mat3(body_.greens().block(a.stored[k], b.stored[l]));
    }
    return sum;
  }
  static MatrixXd all(const NearField& near) {
    const Eigen::Index n = 3 * near.count();
    MatrixXd C(n, n);
    for (Index i = 0; i < n; ++i) {
      for (Index j = 0; j < n; ++j) C(i, j) = near.row(i)[static_cast<std::size_t>(j)];
    }
    return C;
  }
};
INSTANTIATE_TEST_SUITE_P(Elements, Local, testing::Values(ElementType::tet4, ElementType::tet10),
                         [](const auto& tested) { return std::string(traits(tested.param).name); });

TEST_P(Local, IsReciprocal) {
  std::mt19937 random(3);
  std::uniform_int_distribution<Index> any(0, nodes_ - 1);
  int within = 0;
  for (int k = 0; k < 400; ++k) {
    const Index i = any(random), j = k % 10 == 0 ? i : any(random);
    const Mat3 B = between(i, j);
    within += B.isZero(0.0) ? 0 : 1;
    EXPECT_LE((B - between(j, i).transpose()).cwiseAbs().maxCoeff(), 1e-14 * B.cwiseAbs().maxCoeff());
  }
  EXPECT_GT(within, 50);
}

TEST_P(Local, RowsAreThoseOfPairs) {
  const auto count = std::min<Index>(nodes_, 400);
  LocalPoints points(count);
  for (Index node = 0; node < count; ++node) points.set(count - 1 - node, local_.point(node));
  for (Index node = 0; node < count / 2; ++node) {  // in their order, each moved once
    LocalPoints one(2);
    one.set(0, local_.point(node));
    one.move(0, 1);
    for (Index k = 0; k < LocalPoints::components; ++k) ASSERT_EQ(one[k][1], points[k][count - 1 - node]);
  }
  MatrixXd rows(3 * count, 3);  // columns are the three rows
  for (const Index node : {Index{0}, count / 2, count - 1}) {
    rows.setConstant(1.0);
    local_.add_row(local_.point(node), points, count, rows.data());
    for (Index other = 0; other < count; ++other) {
      const Mat3 wanted = between(node, other), B = rows.middleRows(3 * (count - 1 - other), 3).transpose();
      ASSERT_LT((B.array() - 1.0 - wanted.array()).matrix().norm(), 1e-13 * (1.0 + wanted.norm()));
    }
  }
}

// Boussinesq's point force: normal displacement (1 - nu^2) / (pi E r), and towards the force (1 + nu)(1 - 2
// nu) / (2 pi E r); and along the force what its images displace.
TEST_P(Local, IsBoussinesqsBesideAForceAndItsImages) {
  const std::vector<Index> top = on_top(0.2);
  const Index loaded = top.front();
  int with_images = 0;
  for (const Index node : top) {
    const Vec3 x = at(node) - at(loaded);
    const double r = x.norm();
    if (r == 0.0) continue;
    const double of_images = by_images(node, loaded);
    with_images += of_images > 0.0 ? 1 : 0;
    const Vec3 u = between(node, loaded) * Vec3(0.0, 0.0, -1.0);
    EXPECT_NEAR(u.z(),
                -(1.0 + nu) / (std::numbers::pi * E) * (1.0 - nu) * left(r, node, loaded) / r - of_images,
                1e-9 / r);
    EXPECT_NEAR(u.dot(x) / r,
                -left(r, node, loaded) * (1.0 + nu) * (1.0 - 2.0 * nu) / (2.0 * std::numbers::pi * E * r),
                1e-9 / r);
  }
  EXPECT_GT(with_images, 0);
}

// An even pressure p on a disc of radius a displaces the middle by 2 p a (1 - nu^2) / E, and what it
// displaces in the mean is 8 / 3 pi of that (Johnson, Contact Mechanics, 3.4), and images in the edges add to
// both. The difference is free of what the whole body gives way. Errors are of what the middle gives way.
TEST_P(Local, ShowsTheDentOfAnEvenPressure) {
  const std::vector<Index> disc = on_top(0.2);
  NearField near(body_, static_cast<Index>(disc.size()));
  near.begin_tick();
  const auto area = [&](Index node) { return std::numbers::pi * std::pow(local_.point(node).disc, 2); };
  double whole = 0.0;
  for (const Index node : disc) {
    ASSERT_TRUE(near.want(body_, node));
    near.load(near.place_of(node), Vec3(0.0, 0.0, -area(node)));
    whole += area(node);
  }
  near.displace();
  const Index middle = *std::min_element(disc.begin(), disc.end(), [&](Index a, Index b) {
    return (at(a) - Vec3(0.5, 0.5, 1.0)).norm() < (at(b) - Vec3(0.5, 0.5, 1.0)).norm();
  });
  double mean = 0.0, of_mesh_at_middle = 0.0, mean_of_mesh = 0.0;
  for (const Index node : disc) {
    mean -= near.displacement(near.place_of(node)).z() * area(node) / whole;
    for (const Index other : disc) {
      const double u = of_mesh(node, other)(2, 2) * area(other);
      mean_of_mesh += u * area(node) / whole;
      if (node == middle) of_mesh_at_middle += u;
    }
  }
  const double at_middle = -near.displacement(near.place_of(middle)).z();
  const double a = std::sqrt(whole / std::numbers::pi);
  double by_edges = 0.0;
  for (const Index node : disc) {
    for (const Index other : disc)
      by_edges += (by_images(middle, other) - by_images(node, other)) * area(other) * area(node) / whole;
  }
  const double of_half_space = 2.0 * a * (1.0 - nu * nu) / E;
  const double dent = of_half_space * (1.0 - 8.0 / (3.0 * std::numbers::pi)) + by_edges;
  const double ours = at_middle - mean, of_the_mesh = of_mesh_at_middle - mean_of_mesh;
  EXPECT_NEAR(ours, dent, 0.03 * of_half_space);
  if (GetParam() == ElementType::tet4) {  // tet10 is right so far from the force
    EXPECT_GT(std::abs(of_the_mesh - dent), 2.0 * std::abs(ours - dent));
  }
}

// At a corner, over parts of all three faces that are as wide as an element, all but positive definite.
TEST_P(Local, MakesAPositiveDefiniteC) {
  const Vec3 middle(0.5, 0.5, 1.0), edge(0.5, 1.0, 1.0), corner(1.0, 1.0, 1.0);
  for (const Vec3& place : {middle, edge, corner}) {
    for (const double radius : {0.1, 0.2, 0.3}) {
      const std::vector<Index> nodes = around(place, radius);
      NearField near(body_, static_cast<Index>(nodes.size()));
      near.begin_tick();
      for (const Index node : nodes) ASSERT_TRUE(near.want(body_, node));
      const MatrixXd C = all(near);
      EXPECT_LE((C - C.transpose()).cwiseAbs().maxCoeff(), 1e-7 * C.cwiseAbs().maxCoeff());
      const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<MatrixXd>(C).eigenvalues();
      const double least = place == corner && radius > 0.2 ? -1e-3 * values.maxCoeff() : 0.0;
      EXPECT_GT(values.minCoeff(), least) << place.transpose() << " " << radius;
    }
  }
}

TEST_P(Local, MovesPicturesAsTicks) {
  const std::vector<Index> top = on_top(0.2);
  NearField near(body_, static_cast<Index>(top.size()));
  near.begin_tick();
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (const Index node : top) {
    ASSERT_TRUE(near.want(body_, node));
    near.load(near.place_of(node), Vec3(normal(random), normal(random), normal(random)));
  }
  near.displace();
  std::vector<double> stored(static_cast<std::size_t>(body_.greens().order()));
  std::vector<Vec3> u(static_cast<std::size_t>(nodes_));
  surface_displacement(body_, near.load(), stored, u, nullptr);
  double largest = 0.0;
  for (const Vec3& moved : u) largest = std::max(largest, moved.norm());
  for (const Index node : top) {
    EXPECT_LE((u[static_cast<std::size_t>(node)] - near.displacement(near.place_of(node))).norm(),
              1e-6 * largest);
  }
  for (Index node = 0; node < nodes_; ++node) {  // far from the forces their sums are enough
    if ((at(node) - Vec3(0.5, 0.5, 1.0)).norm() < 0.5) continue;
    EXPECT_LE((near.load().far_local_displacement(node) - near.load().local_displacement(node)).norm(),
              0.05 * largest);
  }
}

TEST_P(Local, HoldsWhatIsHeld) {
  for (Index node = 0; node < nodes_; ++node) {
    if (body_.surface_moves(node)) continue;
    EXPECT_TRUE(between(node, node).isZero(0.0));
    EXPECT_TRUE(between(node, (node + 1) % nodes_).isZero(0.0));
  }
}

}  // namespace
}  // namespace palpate::local_compliance_test
