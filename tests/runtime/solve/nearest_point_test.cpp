// Nearest points against the optimality conditions of the convex minimum that they are, and by hand.
#include "runtime/core/solve/nearest_point.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <vector>

namespace palpate::nearest_point_test {
namespace {

using Weights = std::array<double, 3>;

constexpr double eps = std::numeric_limits<double>::epsilon();
// Of the size: the normal of a triangle of height h is known to eps / h, and its edges are h away at the
// most.
constexpr double tolerance = 2e-8;

/// Points and a length that all of them are within.
struct Points {
  std::array<Vec3, 5> p;
  double size = 1.0;
};

/// Coordinates on a coarse grid, so that points often coincide, lie in line or in a plane, some of them with
/// noise of any size, at any scale.
rc::Gen<Points> some_points() {
  return rc::gen::exec([] {
    const double scale = std::pow(10.0, *rc::gen::inRange(-9, 10));
    const double noise = *rc::gen::element(0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1.0);
    Points points;
    for (Vec3& p : points.p) {
      for (double& x : p) {
        x = scale * (*rc::gen::inRange(-2, 3) + noise * *rc::gen::inRange(-1000, 1001) / 1000.0);
      }
    }
    points.size = 6.0 * scale;
    return points;
  });
}

/// The distance by trying all pairs of a vertex, edge or face of one and of the other: the nearest points are
/// inside one of the pairs, where they are the least-squares solution between its planes, lines or points.
long double least_distance(std::span<const Vec3> simplex, std::span<const Vec3> core) {
  using Vector = Eigen::Matrix<long double, Eigen::Dynamic, 1>;
  long double least = std::numeric_limits<long double>::infinity();
  const auto feature_of = [](std::span<const Vec3> corners, unsigned subset) {
    std::vector<Vector> feature;
    for (std::size_t k = 0; k < corners.size(); ++k) {
      if ((subset >> k & 1U) != 0) feature.emplace_back(corners[k].cast<long double>());
    }
    return feature;
  };
  const auto is_inside = [](const Vector& shares) {
    return shares.size() == 0 || (shares.minCoeff() >= 0.0L && shares.sum() <= 1.0L);
  };
  for (unsigned i = 1; i < 1U << simplex.size(); ++i) {
    for (unsigned j = 1; j < 1U << core.size(); ++j) {
      const std::vector<Vector> a = feature_of(simplex, i);
      const std::vector<Vector> b = feature_of(core, j);
      const auto of_a = static_cast<Eigen::Index>(a.size()) - 1;
      const auto of_b = static_cast<Eigen::Index>(b.size()) - 1;
      Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic> sides(3, of_a + of_b);
      for (Eigen::Index k = 0; k < of_a; ++k) sides.col(k) = a[static_cast<std::size_t>(k) + 1] - a[0];
      for (Eigen::Index k = 0; k < of_b; ++k) sides.col(of_a + k) = b[0] - b[static_cast<std::size_t>(k) + 1];
      Vector shares(of_a + of_b);
      if (shares.size() > 0) {
        const Eigen::ColPivHouseholderQR<decltype(sides)> qr(sides);
        if (qr.rank() < shares.size()) continue;  // then a smaller pair is as near
        shares = qr.solve(b[0] - a[0]);
      }
      if (!is_inside(shares.head(of_a)) || !is_inside(shares.tail(of_b))) continue;
      least = std::min(least, (sides * shares - (b[0] - a[0])).norm());
    }
  }
  return least;
}

double distance_error(const NearestPoint& found, std::span<const Vec3> simplex, std::span<const Vec3> core) {
  return static_cast<double>(
      std::abs(std::sqrt(static_cast<long double>(found.squared_distance)) - least_distance(simplex, core)));
}

/// Checks everything that the header promises.
void check(const NearestPoint& found, std::span<const Vec3> simplex, std::span<const Vec3> core,
           double size) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < simplex.size(); ++k) sum += found.weights[k] * simplex[k];
  RC_ASSERT((found.on_simplex - sum).norm() <= 4 * eps * size);
  RC_ASSERT(std::abs(found.weights[0] + found.weights[1] + found.weights[2] - 1.0) <= 2 * eps);
  for (std::size_t k = 0; k < 3; ++k) {
    RC_ASSERT(found.weights[k] >= 0.0);
    RC_ASSERT(k < simplex.size() || found.weights[k] == 0.0);
  }
  if (core.size() == 1) {
    RC_ASSERT(found.on_core == core[0]);
  } else {
    const Vec3 along = core[1] - core[0];
    const double s = along.isZero(0.0) ? 0.0 : along.dot(found.on_core - core[0]) / along.squaredNorm();
    RC_ASSERT(s >= -8 * eps * size / along.norm());
    RC_ASSERT(s <= 1.0 + 8 * eps * size / along.norm());
    RC_ASSERT((core[0] + s * along - found.on_core).norm() <= 8 * eps * size);
  }
  const double squared_distance = (found.on_simplex - found.on_core).squaredNorm();
  if (found.squared_distance == 0.0) {  // cut: the two are the same to rounding
    RC_ASSERT(std::sqrt(squared_distance) <= 1e-11 * size);
  } else {
    RC_ASSERT(std::abs(found.squared_distance - squared_distance) <= 8 * eps * squared_distance);
  }

  RC_ASSERT(distance_error(found, simplex, core) <= tolerance * size);
  const Vec3 apart = found.on_simplex - found.on_core;
  for (std::size_t k = 0; k < simplex.size();
       ++k) {  // a corner that is farther than the others has no weight
    if (apart.dot(simplex[k] - found.on_simplex) > tolerance * size * size) {
      RC_ASSERT(found.weights[k] == 0.0);
    }
  }
}

RC_GTEST_PROP(NearestPoints, OfPointAndTriangleIsTheMinimum, ()) {
  const Points points = *some_points();
  const auto& [a, b, c, p, q] = points.p;
  check(nearest_on_triangle(p, a, b, c), {{a, b, c}}, {{p}}, points.size);
}

RC_GTEST_PROP(NearestPoints, OfPointAndLineIsTheMinimum, ()) {
  const Points points = *some_points();
  const auto& [a, b, c, p, q] = points.p;
  check(nearest_on_line(p, a, b), {{a, b}}, {{p}}, points.size);
}

RC_GTEST_PROP(NearestPoints, OfSegmentAndTriangleIsTheMinimum, ()) {
  const Points points = *some_points();
  const auto& [a, b, c, p, q] = points.p;
  check(nearest_of_segment_and_triangle(p, q, a, b, c), {{a, b, c}}, {{p, q}}, points.size);
}

RC_GTEST_PROP(NearestPoints, OfSegmentsIsTheMinimum, ()) {
  const Points points = *some_points();
  const auto& [a, b, c, p, q] = points.p;
  check(nearest_of_segments(p, q, a, b), {{a, b}}, {{p, q}}, points.size);
}

/// A triangle without small angles at a random place, and what the tests put over it.
class ATriangle {
 public:
  explicit ATriangle(unsigned seed) : random_(seed) {
    do {
      for (Vec3& corner : corners) corner = vector();
      n = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    } while (n.norm() < 0.4);
    n.normalize();
  }

  double number(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  Vec3 vector() { return {number(-1, 1), number(-1, 1), number(-1, 1)}; }
  /// From 1e-9 to 1, as often small as large.
  double distance() { return std::pow(10.0, number(-9, 0)); }

  [[nodiscard]] const Vec3& operator[](std::size_t k) const { return corners[k % 3]; }
  /// In the plane, at right angles to the edge that begins at corner k, away from the triangle.
  [[nodiscard]] Vec3 off_edge(std::size_t k) const {
    return ((*this)[k + 1] - (*this)[k]).cross(n).normalized();
  }
  /// Direction that points more than a little away from both other corners: its nearest point is corner k.
  Vec3 off_corner(std::size_t k) {
    while (true) {
      Vec3 d = vector().normalized();
      if (d.dot((*this)[k + 1] - (*this)[k]) < -0.1 && d.dot((*this)[k + 2] - (*this)[k]) < -0.1) return d;
    }
  }
  /// A direction at right angles to d.
  Vec3 across(const Vec3& d) { return d.cross(vector()).normalized(); }

  std::array<Vec3, 3> corners;
  Vec3 n;

 private:
  std::mt19937 random_;
};

constexpr unsigned cases = 2000;

/// A point at p and segments that begin at p and lead away from x, or lie across the line to x: x stays
/// nearest.
struct Core {
  Vec3 p, q;
};
std::array<Core, 4> cores_nearest_at(ATriangle& t, const Vec3& p, const Vec3& away) {
  const Vec3 leaving = t.across(away) + t.number(0.1, 1.0) * away;
  const Vec3 across = t.across(away);
  return {{{p, p}, {p, p + leaving}, {p + leaving, p}, {p - 0.4 * across, p + 0.7 * across}}};
}

TEST(NearestPoint, OfACornerHasThatWeightAlone) {
  for (unsigned seed = 0; seed < cases; ++seed) {
    ATriangle t(seed);
    const std::size_t k = seed % 3;
    const Vec3 away = t.off_corner(k);
    const Vec3 p = t[k] + t.distance() * away;
    Weights expected{};
    expected[k] = 1.0;
    EXPECT_EQ(nearest_on_triangle(p, t[0], t[1], t[2]).weights, expected);
    for (const Core& core : cores_nearest_at(t, p, away)) {
      if (core.p != core.q && std::abs((core.q - core.p).normalized().dot(away)) < 1e-12)
        continue;  // cuts edges
      const NearestPoint found = nearest_of_segment_and_triangle(core.p, core.q, t[0], t[1], t[2]);
      ASSERT_EQ(found.weights, expected) << seed;
      EXPECT_EQ(found.on_simplex, t[k]);
      EXPECT_LT((found.on_core - p).norm(), 1e-15);
      EXPECT_EQ(nearest_of_segments(core.p, core.q, t[k], t[k + 1]).weights, (Weights{1.0, 0.0, 0.0}));
      EXPECT_EQ(nearest_of_segments(core.p, core.q, t[k + 1], t[k]).weights, (Weights{0.0, 1.0, 0.0}));
    }
  }
}

TEST(NearestPoint, OfAnEdgeHasNoWeightOnTheThirdCorner) {
  for (unsigned seed = 0; seed < cases; ++seed) {
    ATriangle t(seed);
    const std::size_t k = seed % 3;
    const double share = t.number(0.01, 0.99);
    const double slope = t.number(-1.4, 1.4);
    const Vec3 x = (1.0 - share) * t[k] + share * t[k + 1];
    const Vec3 away = std::cos(slope) * t.off_edge(k) + std::sin(slope) * t.n;
    const Vec3 p = x + t.distance() * away;
    const auto is_right = [&](const NearestPoint& found) {
      return found.weights[(k + 2) % 3] == 0.0 && found.weights[k] > 0.0 &&
             found.weights[(k + 1) % 3] > 0.0 && (found.on_simplex - x).norm() < 1e-14 &&
             (found.on_core - p).norm() < 1e-14;
    };
    EXPECT_TRUE(is_right(nearest_on_triangle(p, t[0], t[1], t[2])));
    for (const Core& core : cores_nearest_at(t, p, away)) {
      const Vec3 pq = (core.q - core.p).stableNormalized();
      if (std::abs(pq.dot((t[k + 1] - t[k]).normalized())) > 0.9) continue;  // too parallel for one place
      ASSERT_TRUE(is_right(nearest_of_segment_and_triangle(core.p, core.q, t[0], t[1], t[2]))) << seed;
      const NearestPoint of_segments = nearest_of_segments(core.p, core.q, t[k], t[k + 1]);
      EXPECT_LT((of_segments.on_simplex - x).norm(), 1e-14);
      EXPECT_EQ(of_segments.weights[2], 0.0);
    }
  }
}

TEST(NearestPoint, OfAFaceIsTheFootOnIt) {
  for (unsigned seed = 0; seed < cases; ++seed) {
    ATriangle t(seed);
    const double u = t.number(0.01, 0.9);
    const double v = t.number(0.01, 0.98 - u);
    const Vec3 x = (1.0 - u - v) * t[0] + u * t[1] + v * t[2];
    const Vec3 away = (seed % 2 == 0 ? 1.0 : -1.0) * t.n;
    const Vec3 p = x + t.distance() * away;
    const Vec3 q = p + t.across(away) + t.number(0.1, 1.0) * away;
    for (const NearestPoint& found :
         {nearest_on_triangle(p, t[0], t[1], t[2]), nearest_of_segment_and_triangle(p, q, t[0], t[1], t[2]),
          nearest_of_segment_and_triangle(q, p, t[0], t[1], t[2])}) {
      EXPECT_LT((found.on_simplex - x).norm(), 1e-14) << seed;
      EXPECT_LT((found.on_core - p).norm(), 1e-14);
      EXPECT_NEAR(found.weights[1], u, 1e-14);
      EXPECT_NEAR(found.weights[2], v, 1e-14);
    }
  }
}

TEST(NearestPoint, OfASegmentThroughTheTriangleIsWhereItCuts) {
  for (unsigned seed = 0; seed < cases; ++seed) {
    ATriangle t(seed);
    const double u = t.number(0.01, 0.9);
    const double v = t.number(0.01, 0.98 - u);
    const Vec3 x = (1.0 - u - v) * t[0] + u * t[1] + v * t[2];
    const Vec3 along = t.across(t.n) + t.number(0.1, 2.0) * t.n;
    const NearestPoint found =
        nearest_of_segment_and_triangle(x - t.distance() * along, x + t.distance() * along, t[0], t[1], t[2]);
    EXPECT_EQ(found.squared_distance, 0.0);
    EXPECT_LT((found.on_core - x).norm(), 1e-14) << seed;
    EXPECT_LT((found.on_simplex - x).norm(), 1e-14) << seed;
  }
}

TEST(NearestPoint, OfASegmentWithoutLengthIsThatOfThePoint) {
  for (unsigned seed = 0; seed < cases; ++seed) {
    ATriangle t(seed);
    const Vec3 p = 2.0 * t.vector();
    const NearestPoint of_point = nearest_on_triangle(p, t[0], t[1], t[2]);
    const NearestPoint of_segment = nearest_of_segment_and_triangle(p, p, t[0], t[1], t[2]);
    EXPECT_EQ(of_segment.weights, of_point.weights);
    EXPECT_EQ(of_segment.on_core, p);
    EXPECT_EQ(of_segment.squared_distance, of_point.squared_distance);
    EXPECT_EQ(nearest_of_segments(p, p, t[0], t[1]).squared_distance,
              nearest_on_line(p, t[0], t[1]).squared_distance);
  }
}

/// The thinner the triangle, the worse its normal is known: the distance must not suffer.
TEST(NearestPoint, OfAThinTriangleIsAsNear) {
  for (int digits = 0; digits <= 320; digits += digits < 20 ? 1 : 50) {
    const double height = std::pow(10.0, -digits);
    for (unsigned seed = 0; seed < 200; ++seed) {
      ATriangle t(seed);
      const double share = t.number(-0.2, 1.2);
      t.corners[2] = (1.0 - share) * t[0] + share * t[1] + height * t.off_edge(0);
      const Vec3 p = 2.0 * t.vector();
      const Vec3 q = t[0] + t.number(0.0, 1.0) * (t[1] - t[0]) + t.number(-1, 1) * height * t.vector();
      const std::array<Vec3, 1> point = {p};
      const std::array<Vec3, 2> segment = {p, q};
      EXPECT_LT(distance_error(nearest_on_triangle(p, t[0], t[1], t[2]), t.corners, point), tolerance)
          << digits;
      EXPECT_LT(distance_error(nearest_of_segment_and_triangle(p, q, t[0], t[1], t[2]), t.corners, segment),
                tolerance)
          << digits;
    }
  }
}

TEST(NearestPoint, OfATriangleWithoutAreaIsThatOfItsLongestEdge) {
  const Vec3 a(0, 0, 0), b(1, 2, 2), c(3, 6, 6);
  const Vec3 p = 2.0 * b + Vec3(2, -1, 0);
  for (const auto& t : {std::array{a, b, c}, {a, c, b}, {b, a, c}, {b, c, a}, {c, a, b}, {c, b, a}}) {
    const NearestPoint found = nearest_on_triangle(p, t[0], t[1], t[2]);
    EXPECT_DOUBLE_EQ(found.squared_distance, 5.0);
    EXPECT_LT((found.on_simplex - 2.0 * b).norm(), 1e-14);
  }
  for (const NearestPoint& found :
       {nearest_on_triangle(p, a, a, a), nearest_on_line(p, a, a), nearest_of_segments(p, p, a, a),
        nearest_of_segment_and_triangle(p, p, a, a, a),
        nearest_of_segment_and_triangle(p, 2.0 * p, a, a, a)}) {
    EXPECT_EQ(*std::max_element(found.weights.begin(), found.weights.end()), 1.0);
    EXPECT_EQ(found.on_simplex, a);
    EXPECT_EQ(found.on_core, p);
    EXPECT_EQ(found.squared_distance, 41.0);
  }
}

TEST(NearestPoint, IsFiniteAtAnySize) {
  const double largest = std::numeric_limits<double>::max();
  const double smallest = std::numeric_limits<double>::denorm_min();
  std::mt19937 random(1);
  const std::array<double, 9> sizes = {0.0, 1.0, -1.0, largest, -largest, 1e154, -1e200, smallest, 1e-170};
  const auto vector = [&] {
    Vec3 v;
    for (double& x : v) x = sizes[random() % sizes.size()];
    return v;
  };
  for (int k = 0; k < 20000; ++k) {
    const Vec3 p = vector(), q = vector(), a = vector(), b = vector(), c = vector();
    for (const NearestPoint& found :
         {nearest_on_triangle(p, a, b, c), nearest_on_line(p, a, b),
          nearest_of_segment_and_triangle(p, q, a, b, c), nearest_of_segments(p, q, a, b)}) {
      ASSERT_TRUE(found.on_simplex.allFinite() && found.on_core.allFinite());
      ASSERT_TRUE(std::isfinite(found.squared_distance));
      for (const double weight : found.weights) ASSERT_TRUE(weight >= 0.0 && weight <= 1.0);
      ASSERT_NEAR(found.weights[0] + found.weights[1] + found.weights[2], 1.0, 1e-15);
    }
  }
}

}  // namespace
}  // namespace palpate::nearest_point_test
