// Nearest points of a disc against the plane that parts it from the simplex, dense samples, and by hand.
#include "runtime/core/solve/nearest_on_disc.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <string>

namespace palpate::nearest_on_disc_test {
namespace {

using Weights = std::array<double, 3>;

constexpr double eps = std::numeric_limits<double>::epsilon();
// Of the size: a distance is known to eps, so that where it is sqrt(eps) its direction is known to sqrt(eps).
constexpr double tolerance = 1e-7;

struct Case {
  Disc disc;
  std::array<Vec3, 3> corner;
  double size;
};

/// On a coarse grid, so that the two often touch, cut, are parallel or lie in one plane, some of them with
/// noise of any size, at any scale.
rc::Gen<Case> some_cases() {
  return rc::gen::exec([] {
    const double scale = std::pow(10.0, *rc::gen::inRange(-6, 7));
    const double noise = *rc::gen::element(0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1.0);
    const auto vector = [&] {
      Vec3 v;
      for (double& x : v) x = *rc::gen::inRange(-2, 3) + noise * *rc::gen::inRange(-1000, 1001) / 1000.0;
      return v;
    };
    Case one;
    one.disc.centre = scale * vector();
    one.disc.axis = vector();
    if (one.disc.axis.norm() < 1e-3) one.disc.axis = Vec3::UnitZ();
    one.disc.axis.normalize();
    one.disc.radius = scale * *rc::gen::element(1e-3, 0.5, 1.0, 2.0, 3.0);
    for (Vec3& corner : one.corner) corner = scale * vector();
    one.size = 6.0 * scale;
    return one;
  });
}

/// How far apart a disc and a simplex are at least: the gap between the planes across a direction that touch
/// each of them. For the direction of the nearest points it is their distance.
double gap_across(const Vec3& direction, const Disc& disc, std::span<const Vec3> simplex) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Vec3& corner : simplex) nearest = std::min(nearest, direction.dot(corner - disc.centre));
  const Vec3 in_plane = direction - disc.axis.dot(direction) * disc.axis;
  return nearest - disc.radius * in_plane.norm();
}

/// Whether the points are where they are said to be, and nearest: all that the header promises.
testing::AssertionResult is_nearest(const NearestPoint& found, const Case& one,
                                    std::span<const Vec3> simplex) {
  const auto wrong = [&](const char* what) {
    return testing::AssertionFailure() << what << ", distance " << std::sqrt(found.squared_distance);
  };
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < simplex.size(); ++k) sum += found.weights[k] * simplex[k];
  if (!((found.on_simplex - sum).norm() <= 8 * eps * one.size)) return wrong("not at its weights");
  if (std::abs(found.weights[0] + found.weights[1] + found.weights[2] - 1.0) > 4 * eps)
    return wrong("weights do not add up to 1");
  for (std::size_t k = 0; k < 3; ++k) {
    if (found.weights[k] < 0.0 || (k >= simplex.size() && found.weights[k] != 0.0))
      return wrong("not within the simplex");
  }
  const Vec3 from_centre = found.on_core - one.disc.centre;
  if (std::abs(from_centre.dot(one.disc.axis)) > 1e-14 * one.size) return wrong("not in the disc's plane");
  if (from_centre.norm() > one.disc.radius + 1e-14 * one.size) return wrong("outside of the rim");
  const Vec3 apart = found.on_simplex - found.on_core;
  const double distance = apart.norm();
  if (found.squared_distance == 0.0) {
    return distance <= tolerance * one.size ? testing::AssertionSuccess() : wrong("told to cut");
  }
  if (std::abs(std::sqrt(found.squared_distance) - distance) > 8 * eps * one.size) return wrong("distance");
  if (distance <= tolerance * one.size) return testing::AssertionSuccess();
  return gap_across(apart / distance, one.disc, simplex) >= distance - tolerance * one.size
             ? testing::AssertionSuccess()
             : wrong("there are nearer points");
}

RC_GTEST_PROP(NearestOnDisc, OfAPointIsTheMinimum, ()) {
  const Case one = *some_cases();
  const Vec3& p = one.corner[0];
  const Vec3 nearest = nearest_on_disc(one.disc, p);
  const NearestPoint found{.weights = {1.0, 0.0, 0.0},
                           .on_simplex = p,
                           .on_core = nearest,
                           .squared_distance = (p - nearest).squaredNorm()};
  const testing::AssertionResult result = is_nearest(found, one, {&p, 1});
  if (!result) RC_FAIL(std::string(result.message()));
}

RC_GTEST_PROP(NearestOnDisc, OfALineIsTheMinimum, ()) {
  const Case one = *some_cases();
  const std::span<const Vec3> line = std::span(one.corner).first(2);
  const auto found = nearest_of_disc_and_line(one.disc, line[0], line[1]);
  const testing::AssertionResult result = is_nearest(found, one, line);
  if (!result) RC_FAIL(std::string(result.message()));
}

RC_GTEST_PROP(NearestOnDisc, OfATriangleIsTheMinimum, ()) {
  const Case one = *some_cases();
  const auto& [a, b, c] = one.corner;
  const testing::AssertionResult result =
      is_nearest(nearest_of_disc_and_triangle(one.disc, a, b, c), one, one.corner);
  if (!result) RC_FAIL(std::string(result.message()));
}

class Random {
 public:
  explicit Random(unsigned seed) : random_(seed) {}
  double number(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  Vec3 vector() { return {number(-1, 1), number(-1, 1), number(-1, 1)}; }
  Case scene() {
    return {{0.3 * vector(), vector().normalized(), number(0.05, 1.0)}, {vector(), vector(), vector()}, 2.0};
  }

 private:
  std::mt19937 random_;
};

TEST(NearestOnDisc, NoSampleOfATriangleIsNearer) {
  constexpr int steps = 60;
  for (unsigned seed = 0; seed < 400; ++seed) {
    const Case one = Random(seed).scene();
    const auto& [a, b, c] = one.corner;
    const double found = std::sqrt(nearest_of_disc_and_triangle(one.disc, a, b, c).squared_distance);
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; i + j <= steps; ++j) {
        const Vec3 x = a + (b - a) * i / steps + (c - a) * j / steps;
        least = std::min(least, (x - nearest_on_disc(one.disc, x)).norm());
      }
    }
    EXPECT_LE(found, least + 1e-14) << seed;
    EXPECT_GE(found, least - 3.5 / steps) << seed;
  }
}

/// A disc of radius 1 in the plane z = 0.
constexpr double radius = 1.0;
Disc flat() {
  return {Vec3::Zero(), Vec3::UnitZ(), radius};
}

TEST(NearestOnDisc, OfAPointIsBelowItOrOnTheRim) {
  EXPECT_EQ(nearest_on_disc(flat(), Vec3(0, 0, 3)), Vec3(0, 0, 0)) << "on the axis";
  EXPECT_EQ(nearest_on_disc(flat(), Vec3(0, 0, 0)), Vec3(0, 0, 0));
  EXPECT_EQ(nearest_on_disc(flat(), Vec3(0.5, -0.25, -2)), Vec3(0.5, -0.25, 0));
  EXPECT_EQ(nearest_on_disc(flat(), Vec3(0, 4, 7)), Vec3(0, 1, 0));
  EXPECT_EQ(nearest_on_disc(flat(), Vec3(-1, 0, 0)), Vec3(-1, 0, 0));
}

TEST(NearestOnDisc, OfALineThatCutsItIsTheCut) {
  const NearestPoint found = nearest_of_disc_and_line(flat(), {0.5, 0, 1}, {0.5, 0.5, -3});
  EXPECT_EQ(found.squared_distance, 0.0);
  EXPECT_LT((found.on_simplex - Vec3(0.5, 0.125, 0)).norm(), 1e-15);
  EXPECT_GT(nearest_of_disc_and_line(flat(), {1.5, 0, 1}, {1.5, 0, -3}).squared_distance, 0.24);
}

TEST(NearestOnDisc, OfAParallelLineIsOverTheDisc) {
  for (const double height : {0.0, 1e-9, 2.0}) {
    const NearestPoint over = nearest_of_disc_and_line(flat(), {-3, 0.5, height}, {2, 0.5, height});
    EXPECT_DOUBLE_EQ(std::sqrt(over.squared_distance), height);
    EXPECT_LE(std::abs(over.on_simplex.x()), std::sqrt(0.75) + 1e-12);
    const NearestPoint beside = nearest_of_disc_and_line(flat(), {-3, 2, height}, {2, 2, height});
    EXPECT_NEAR(beside.squared_distance, 1.0 + height * height, 1e-15);
    EXPECT_NEAR(beside.on_simplex.x(), 0.0, 1e-12);
  }
}

TEST(NearestOnDisc, OfALineWithoutLengthIsThatOfThePoint) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    const Case one = Random(seed).scene();
    const Vec3& p = one.corner[0];
    for (const NearestPoint& found :
         {nearest_of_disc_and_line(one.disc, p, p), nearest_of_disc_and_triangle(one.disc, p, p, p)}) {
      EXPECT_EQ(*std::max_element(found.weights.begin(), found.weights.end()), 1.0);
      EXPECT_LT((found.on_core - nearest_on_disc(one.disc, p)).norm(), 1e-15);
    }
  }
}

TEST(NearestOnDisc, OfATriangleThatTheDiscCutsHasNoDistance) {
  for (unsigned seed = 0; seed < 500; ++seed) {
    Random random(seed);
    Case one = random.scene();
    const auto& [a, b, c] = one.corner;
    const double u = random.number(0.02, 0.9);
    const double v = random.number(0.02, 0.96 - u);
    const Vec3 within = random.vector().cross(one.disc.axis).normalized();
    one.disc.centre = (1 - u - v) * a + u * b + v * c - random.number(0.0, 0.99) * one.disc.radius * within;
    EXPECT_EQ(nearest_of_disc_and_triangle(one.disc, a, b, c).squared_distance, 0.0) << seed;
  }
}

TEST(NearestOnDisc, OfATriangleUnderTheRimIsTheRimsLowestPoint) {
  for (const double tilt : {1e-13, 1e-6, 0.1, 1.0, M_PI_2}) {
    const Disc disc{Vec3(0.2, 0.1, 2.0), Vec3(std::sin(tilt), 0.0, std::cos(tilt)), radius};
    const NearestPoint found = nearest_of_disc_and_triangle(disc, {-9, -9, 0}, {9, -9, 0}, {0, 9, 0});
    const Vec3 lowest = disc.centre + radius * Vec3(std::cos(tilt), 0.0, -std::sin(tilt));
    EXPECT_LT((found.on_core - lowest).norm(), 1e-15 + 1e-15 / tilt) << tilt;
    EXPECT_NEAR(std::sqrt(found.squared_distance), 2.0 - std::sin(tilt), 1e-15);
    for (const double weight : found.weights) EXPECT_GT(weight, 0.0);
  }
}

TEST(NearestOnDisc, ACornerThatIsNearestHasAllTheWeight) {
  const NearestPoint found =
      nearest_of_disc_and_triangle(flat(), {0.2, 0.1, 1}, {0.9, 0.1, 2}, {0.2, 0.9, 3});
  EXPECT_EQ(found.weights, (Weights{1.0, 0.0, 0.0}));
  EXPECT_EQ(found.on_core, Vec3(0.2, 0.1, 0));
  EXPECT_EQ(nearest_of_disc_and_line(flat(), {5, 5, 2}, {4, 4, 1}).weights, (Weights{0.0, 1.0, 0.0}));
}

TEST(NearestOnDisc, ALinePassesOverTheRimTwice) {
  const auto [first, second] = shares_over_rim(flat(), {-3, 0, 7}, {1, 0, -2});
  EXPECT_NEAR(first, 0.5, 1e-15);
  EXPECT_NEAR(second, 1.0, 1e-15);
  EXPECT_TRUE(std::isnan(shares_over_rim(flat(), {-3, 2, 0}, {1, 2, 0})[0])) << "beside the disc";
  EXPECT_TRUE(std::isnan(shares_over_rim(flat(), {0.5, 0, 0}, {0.5, 0, 1})[1])) << "along the axis";
}

TEST(NearestOnDisc, IsFiniteAtAnySize) {
  const double largest = std::numeric_limits<double>::max();
  const double smallest = std::numeric_limits<double>::denorm_min();
  std::mt19937 random(1);
  const std::array<double, 9> sizes = {0.0, 1.0, -1.0, largest, -largest, 1e154, -1e200, smallest, 1e-170};
  const auto vector = [&] {
    Vec3 v;
    for (double& x : v) x = sizes[random() % sizes.size()];
    return v;
  };
  const std::array<double, 3> radii = {1e-170, 1.0, 1e154};
  for (int k = 0; k < 20000; ++k) {
    const Disc disc{vector(), Vec3::Unit(k % 3), radii[random() % radii.size()]};
    const Vec3 a = vector(), b = vector(), c = vector();
    for (const NearestPoint& found :
         {nearest_of_disc_and_line(disc, a, b), nearest_of_disc_and_triangle(disc, a, b, c)}) {
      ASSERT_TRUE(found.on_simplex.allFinite() && found.on_core.allFinite());
      ASSERT_TRUE(std::isfinite(found.squared_distance));
      for (const double weight : found.weights) ASSERT_TRUE(weight >= 0.0 && weight <= 1.0);
      ASSERT_NEAR(found.weights[0] + found.weights[1] + found.weights[2], 1.0, 1e-15);
    }
  }
}

}  // namespace
}  // namespace palpate::nearest_on_disc_test
