// Velocity by adaptive windowing: the bounds that end points known to half a resolution allow.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "runtime/safety/velocity_estimator.h"

namespace palpate::velocity_test {
namespace {

constexpr std::int64_t millisecond = 1'000'000;
constexpr double period = 1e-3;
constexpr double resolution = 1e-4;
constexpr double widest = 14.0 * period;  // of a window of 15 places

double quantised(double x) {
  return resolution * std::round(x / resolution);
}

TEST(Velocity, ConstantSpeedIsExactUpToRounding) {
  VelocityEstimator estimator(Vec3::Constant(resolution));
  const Vec3 speed(0.3, -0.02, 0.0);
  EXPECT_EQ(estimator.take(Vec3(1, 2, 3), 0), Vec3::Zero());
  std::mt19937 random(3);
  std::int64_t time = 0;
  for (int k = 0; k < 100; ++k) {
    time += millisecond / 2 + static_cast<std::int64_t>(random() % millisecond);  // arrivals are not even
    const Vec3 velocity = estimator.take(Vec3(1, 2, 3) + 1e-9 * static_cast<double>(time) * speed, time);
    EXPECT_LT((velocity - speed).norm(), 1e-10);
  }
}

TEST(Velocity, QuantisedConstantSpeedUsesTheWholeWindow) {
  // Both ends are wrong by half the resolution at most.
  for (const double speed : {0.5, 0.03, 0.004, -0.2}) {
    VelocityEstimator estimator(Vec3::Constant(resolution));
    for (int k = 0; k < 500; ++k) {
      const double v = estimator.take(Vec3(quantised(speed * k * period), 0, 0), k * millisecond).x();
      if (k >= 14) {
        EXPECT_LE(std::abs(v - speed), 1.000001 * resolution / widest) << speed << " " << k;
      }
    }
  }
}

TEST(Velocity, RampOfSpeedLagsByHalfTheWindowThatFits) {
  // x = a t^2 / 2: over n periods the slope is that of the middle, a n T / 2 behind, and misses the places
  // between by at most a (n T)^2 / 8. The window grows until that is the resolution.
  constexpr double acceleration = 20.0;
  int n = 1;
  // The farthest place between the ends is the middle one.
  const auto misses = [&](int window) {
    const int half = window / 2;
    return 0.5 * acceleration * period * period * half * (window - half);
  };
  while (n < 14 && misses(n + 1) <= resolution) ++n;
  ASSERT_GT(n, 2);
  ASSERT_LT(n, 14);
  VelocityEstimator estimator(Vec3::Constant(resolution));
  for (int k = 0; k < 100; ++k) {
    const double t = k * period;
    const double v = estimator.take(Vec3(0, 0.5 * acceleration * t * t, 0), k * millisecond).y();
    if (k >= 14) {
      EXPECT_NEAR(v, acceleration * (t - 0.5 * n * period), 1e-9) << k;
    }
  }
}

TEST(Velocity, QuantisedSineStaysWithinItsBoundAndBeatsDifferences) {
  // A slope over a window d is that of the sine within it (off by at most A w^2 d) plus resolution / d; d is
  // such that the sine leaves its chord by not more than two resolutions, A w^2 d^2 / 8 <= 2 r, where it
  // bends most.
  constexpr double amplitude = 0.02;
  const double w = 2.0 * std::numbers::pi * 2.0;
  VelocityEstimator estimator(Vec3::Constant(resolution));
  double worst = 0.0;
  double worst_difference = 0.0;
  double before = 0.0;
  for (int k = 0; k < 3000; ++k) {
    const double t = k * period;
    const double x = quantised(amplitude * std::sin(w * t));
    const double truth = amplitude * w * std::cos(w * t);
    const double v = estimator.take(Vec3(0, 0, x), k * millisecond).z();
    if (k >= 14) {
      worst = std::max(worst, std::abs(v - truth));
      worst_difference = std::max(worst_difference, std::abs((x - before) / period - truth));
    }
    before = x;
  }
  const double bend = amplitude * w * w;
  const double longest = std::min(widest, std::sqrt(16.0 * resolution / bend));
  const double shortest = std::sqrt(resolution / bend);  // a chord over less leaves no room for a miss
  EXPECT_LT(worst, bend * longest + resolution / shortest);
  EXPECT_LT(worst, 0.5 * worst_difference);
}

TEST(Velocity, StandingStillIsNothing) {
  VelocityEstimator estimator(Vec3::Constant(resolution));
  std::int64_t time = 0;
  for (int k = 0; k < 20; ++k) {
    estimator.take(Vec3(0.01 * k, -0.01 * k, 0), time += millisecond);
  }
  const Vec3 place(0.19, -0.19, 0);
  for (int k = 0; k < 15; ++k) {
    estimator.take(place, time += millisecond);
  }
  EXPECT_EQ(estimator.take(place, time += millisecond), Vec3::Zero());
}

TEST(Velocity, AStopIsSeenAtOnce) {
  VelocityEstimator estimator(Vec3::Constant(resolution));
  for (int k = 0; k <= 20; ++k) {
    estimator.take(Vec3(0.3 * period * k, 0, 0), k * millisecond);
  }
  EXPECT_EQ(estimator.take(Vec3(0.3 * period * 20, 0, 0), 21 * millisecond), Vec3::Zero());
}

TEST(Velocity, NoTimeNoChange) {
  VelocityEstimator estimator(Vec3::Constant(resolution));
  estimator.take(Vec3::Zero(), 0);
  const Vec3 velocity = estimator.take(Vec3(1e-3, 0, 0), millisecond);
  EXPECT_DOUBLE_EQ(velocity.x(), 1.0);
  EXPECT_EQ(estimator.take(Vec3(5, 5, 5), millisecond), velocity);
  EXPECT_EQ(estimator.take(Vec3(5, 5, 5), 0), velocity);
}

}  // namespace
}  // namespace palpate::velocity_test
