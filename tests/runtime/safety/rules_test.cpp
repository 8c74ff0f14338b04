// Each safety rule by itself, against its formula.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "runtime/safety/buzz_detector.h"
#include "runtime/safety/clamps.h"
#include "runtime/safety/deadline_watch.h"
#include "runtime/safety/engagement.h"
#include "runtime/safety/plausible.h"
#include "runtime/safety/silence_watch.h"
#include "runtime/safety/speed_limit.h"
#include "runtime/safety/stale_solution.h"
#include "runtime/safety/stiffness_limit.h"

namespace palpate::rules_test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double ms = 0.001;               // s
constexpr std::int64_t ms_ns = 1'000'000;  // ns

Mat3 random_matrix(std::mt19937& random) {
  std::normal_distribution<double> entry;
  return Mat3::NullaryExpr([&] { return entry(random); });
}

TEST(Plausible, NumbersAndTimes) {
  EXPECT_TRUE(is_plausible(Vec3(1e99, -1e99, 0)));
  for (const double bad : {nan, inf, -inf, 1e101}) {
    EXPECT_FALSE(is_plausible(bad));
    EXPECT_FALSE(is_plausible(Vec3(0, bad, 0)));
    DeviceState device;
    device.pose.orientation.z() = bad;
    EXPECT_FALSE(is_plausible(device));
    DeviceCommand command;
    command.local.stiffness(1, 2) = bad;
    EXPECT_FALSE(is_plausible(command));
  }
  EXPECT_EQ(seconds_between(2'000'000'000, 5'000'000'000), 3.0);
  EXPECT_GT(
      seconds_between(std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()),
      1e10);
}

TEST(Clamp, KeepsTheDirection) {
  const Vec3 force(3, 4, 0);
  EXPECT_EQ(clamped(force, 5.0), force);
  EXPECT_TRUE(clamped(force, 1.0).isApprox(Vec3(0.6, 0.8, 0)));
  EXPECT_EQ(clamped(force, 0.0), Vec3::Zero());
  EXPECT_EQ(clamped(Vec3::Zero(), 0.0), Vec3::Zero());
  for (const double bad : {nan, inf, 1e200}) EXPECT_EQ(clamped(Vec3(bad, 1, 1), 5.0), Vec3::Zero());
}

TEST(RateClamp, FollowsInStraightLineAtItsRateAndArrives) {
  RateClamp clamp(500.0);
  const Vec3 wanted(0.0, 3.0, 4.0);
  for (int k = 1; k < 10; ++k) EXPECT_TRUE(clamp.follow(wanted, ms).isApprox(0.1 * k * wanted, 1e-12));
  EXPECT_TRUE(clamp.follow(wanted, ms).isApprox(wanted));
  EXPECT_EQ(clamp.follow(wanted, ms), wanted);
  EXPECT_EQ(clamp.follow(Vec3::Zero(), 0.0), wanted);
  clamp.reset();
  EXPECT_NEAR(clamp.follow(wanted, ms).norm(), 0.5, 1e-12);
}

TEST(StiffnessLimit, ClampsEigenvalues) {
  std::mt19937 random(1);
  for (int k = 0; k < 200; ++k) {
    const Mat3 any = 1000.0 * random_matrix(random);
    const Mat3 limited = limited_stiffness(any, 800.0);
    const Eigen::SelfAdjointEigenSolver<Mat3> before(Mat3(0.5 * (any + any.transpose())));
    const Eigen::SelfAdjointEigenSolver<Mat3> after(limited);
    const Vec3 expected = before.eigenvalues().cwiseMax(0.0).cwiseMin(800.0);
    EXPECT_LT((after.eigenvalues() - expected).norm(), 1e-4);
    EXPECT_LT((limited - limited.transpose()).norm(), 1e-9);
  }
}

TEST(StiffnessLimit, LeavesWhatIsSoft) {
  std::mt19937 random(2);
  const Mat3 A = random_matrix(random);
  const Mat3 soft = A * A.transpose();
  EXPECT_TRUE(limited_stiffness(soft, 1000.0).isApprox(soft, 1e-6));
  EXPECT_EQ(limited_stiffness(Mat3::Constant(nan), 1000.0), Mat3::Zero());
  EXPECT_EQ(limited_stiffness(Mat3::Constant(1e200), 1000.0), Mat3::Zero());
}

TEST(EngageGate, OpensWhenForceIsSmallForAWhileOutsideTheBody) {
  EngageGate gate(0.1, 9.5 * ms);
  for (int k = 0; k < 100; ++k) EXPECT_FALSE(gate.pass(0.2, false, ms));
  for (int k = 0; k < 100; ++k) EXPECT_FALSE(gate.pass(0.0, true, ms));
  for (int k = 0; k < 9; ++k) EXPECT_FALSE(gate.pass(0.1, false, ms));
  EXPECT_FALSE(gate.pass(0.2, false, ms));  // from the beginning
  EXPECT_FALSE(gate.pass(nan, false, ms));
  for (int k = 0; k < 9; ++k) EXPECT_FALSE(gate.pass(0.05, false, ms));
  EXPECT_TRUE(gate.pass(0.05, false, ms));
  EXPECT_TRUE(gate.pass(100.0, true, ms));  // then it stays open
  gate.close();
  EXPECT_FALSE(gate.pass(0.0, false, ms));
}

TEST(Ramp, IsLinear) {
  Ramp ramp(0.5);
  for (int k = 1; k <= 500; ++k) EXPECT_NEAR(ramp.advance(ms), k / 500.0, 1e-12);
  EXPECT_NEAR(ramp.advance(1.0), 1.0, 1e-12);
  EXPECT_EQ(ramp.advance(1.0), 1.0);
  ramp.restart();
  EXPECT_EQ(ramp.share(), 0.0);
  Ramp none(0.0);
  EXPECT_EQ(none.advance(ms), 1.0);
}

TEST(DeadlineWatch, LateTicksFadeTheForceAndTicksInTimeBringItBack) {
  DeadlineWatch watch({.fade = 5 * ms, .recovery = 100 * ms}, ms);
  watch.see(0.4 * ms, ms);
  EXPECT_EQ(watch.share(), 1.0);
  for (int k = 1; k <= 3; ++k) {
    watch.see(0.6 * ms, ms);
    EXPECT_NEAR(watch.share(), 1.0 - k / 5.0, 1e-12);
  }
  EXPECT_NEAR(watch.misses(), 3.0, 1e-12);
  for (int k = 1; k <= 60; ++k) {
    watch.see(0.0, ms);
    EXPECT_NEAR(watch.share(), 0.4 + 0.01 * k, 1e-12);
  }
}

TEST(DeadlineWatch, FailsAfterSoManyMissesOrOneLongGap) {
  DeadlineWatch row({.most = 10.0}, ms);
  for (int k = 0; k < 9; ++k) row.see(ms, ms);
  EXPECT_FALSE(row.failed());
  row.see(ms, ms);
  EXPECT_TRUE(row.failed());
  row.reset();
  EXPECT_FALSE(row.failed());
  DeadlineWatch gap({.most = 10.0}, ms);
  gap.see(9 * ms, 10 * ms);
  EXPECT_EQ(gap.share(), 0.0);
  EXPECT_TRUE(gap.failed());
}

TEST(DeadlineWatch, ForgivesOneMissInAHundred) {
  DeadlineWatch seldom({.most = 10.0, .forgiveness = 0.01}, ms);
  DeadlineWatch often = seldom;
  for (int k = 0; k < 100'000; ++k) {
    seldom.see(k % 102 == 0 ? ms : 0.0, ms);
    often.see(k % 50 == 0 ? ms : 0.0, ms);
    EXPECT_FALSE(seldom.failed());
  }
  EXPECT_TRUE(often.failed());
}

DeviceState report(std::uint32_t sequence, const Vec3& position = Vec3::Zero()) {
  DeviceState device;
  device.pose.position = position;
  device.sequence = sequence;
  device.arrived = ms_ns * std::int64_t{sequence};
  return device;
}

TEST(SilenceWatch, FadesThenIsSilent) {
  SilenceWatch watch({.most = 20 * ms, .fade_from = 5 * ms});
  EXPECT_TRUE(watch.observe(report(7), 7 * ms_ns, 0.0));  // came at 7 ms
  for (int k = 7; k <= 27; ++k) {
    EXPECT_EQ(watch.observe(report(7), k * ms_ns, 0.0), false);
    EXPECT_NEAR(watch.share(), std::min(1.0, (27.0 - k) / 15.0), 1e-12);
    EXPECT_FALSE(watch.silent());
  }
  watch.observe(report(7), 27 * ms_ns + 1, 0.0);
  EXPECT_TRUE(watch.silent());
  EXPECT_TRUE(watch.observe(report(22), 28 * ms_ns, 0.0));
  EXPECT_FALSE(watch.silent());
  EXPECT_NEAR(watch.share(), 14.0 / 15.0, 1e-12) << "the loop was late: it came 6 ms ago";
  EXPECT_TRUE(watch.observe(report(30), 29 * ms_ns, 0.0));
  EXPECT_EQ(watch.share(), 1.0) << "it came after the tick had begun";
}

TEST(SilenceWatch, OldNumbersAndNoNumbersAreNoReports) {
  SilenceWatch watch({});
  EXPECT_EQ(watch.share(), 0.0);
  EXPECT_FALSE(watch.observe(report(7, Vec3(nan, 0, 0)), 0, 0.0));
  EXPECT_EQ(watch.share(), 0.0);
  EXPECT_TRUE(watch.observe(report(7), 0, 0.0));
  EXPECT_FALSE(watch.observe(report(6), 0, 0.0));
  EXPECT_FALSE(watch.observe(report(8, Vec3(0, inf, 0)), 0, 0.0));
  EXPECT_TRUE(watch.observe(report(8), 0, 0.0));
  watch.reset();
  EXPECT_TRUE(watch.observe(report(0xFFFFFFFF), 0, 0.0));
  EXPECT_TRUE(watch.observe(report(0), 0, 0.0));  // it wraps around
  EXPECT_FALSE(watch.observe(report(0xFFFFFFFF), 0, 0.0));
}

TEST(SilenceWatch, FrozenNumbersAreSeenWhileForceIsShown) {
  const auto frozen = [](double force, double motion) {
    SilenceWatch watch({.frozen = 0.25, .frozen_force = 0.1});
    for (int k = 0; k <= 300; ++k)
      watch.observe(report(static_cast<std::uint32_t>(k), Vec3(motion * k, 0, 0)), k * ms_ns, force);
    EXPECT_FALSE(watch.silent());
    return watch.frozen();
  };
  EXPECT_TRUE(frozen(0.2, 0.0));
  EXPECT_FALSE(frozen(0.05, 0.0));
  EXPECT_FALSE(frozen(0.2, 1e-9));
}

DeviceCommand spring() {
  DeviceCommand solution;
  solution.wrench.force = Vec3(0, 0, 1);
  solution.local = {.force = solution.wrench.force,
                    .stiffness = Vec3(10.0, 20.0, 300.0).asDiagonal(),
                    .point = Vec3(0, 0, -0.01),
                    .radius = 0.002};
  return solution;
}

TEST(StaleSolution, IsTheLocalModelWithDampingWhenItIsOld) {
  StaleSolution stale({.damping = 0.5});
  const Vec3 moved(0.0001, 0.0002, -0.001);
  const Vec3 velocity(0.1, 0.0, -0.2);
  const Vec3 field = Vec3(0, 0, 1) - Vec3(0.001, 0.004, -0.3);
  const Vec3 position = spring().local.point + moved;
  EXPECT_TRUE(stale.force(spring(), position, velocity, 1 * ms, ms).isApprox(field, 1e-12));
  EXPECT_TRUE(stale.force(spring(), position, velocity, 5 * ms, ms).isApprox(field - 0.5 * velocity, 1e-12));
  EXPECT_EQ(stale.share(), 1.0);
}

TEST(StaleSolution, BeyondTheRadiusItIsThatOfTheEdgeAndFades) {
  StaleSolution stale({.fade = 20 * ms, .damping = 0.0});
  const Vec3 far = spring().local.point + Vec3(0, 0, 0.01);
  for (int k = 1; k <= 20; ++k) {
    const Vec3 force = stale.force(spring(), far, Vec3::Zero(), 3 * ms, ms);
    EXPECT_TRUE(force.isApprox(Vec3(0, 0, 1.0 - 300.0 * 0.002), 1e-12));
    EXPECT_NEAR(stale.share(), 1.0 - k / 20.0, 1e-12);
  }
  stale.force(spring(), spring().local.point, Vec3::Zero(), 3 * ms,
              ms);  // back within: only a new one counts
  EXPECT_NEAR(stale.share(), 0.0, 1e-12);
}

TEST(StaleSolution, FadesAfterItsTimeToLiveAndComesBackAsItWent) {
  StaleSolution stale({.time_to_live = 10 * ms, .fade = 20 * ms});
  for (int k = 0; k <= 40; ++k) {
    stale.force(spring(), spring().local.point, Vec3::Zero(), k * ms, ms);
    EXPECT_NEAR(stale.share(), std::clamp((30.0 - k) / 20.0, 0.0, 1.0), 1e-9) << k;
  }
  for (int k = 1; k <= 20; ++k) {
    stale.force(spring(), spring().local.point, Vec3::Zero(), 0.0, ms);
    EXPECT_NEAR(stale.share(), k / 20.0, 1e-12);
  }
}

// The thread that writes to the device may begin late.
TEST(StaleSolution, HasFadedByItsAgeWhenItArrivesOld) {
  StaleSolution stale({.time_to_live = 10 * ms, .fade = 20 * ms});
  stale.force(spring(), spring().local.point, Vec3::Zero(), 25 * ms, 0.0);
  EXPECT_NEAR(stale.share(), 0.25, 1e-12);
  stale.force(spring(), spring().local.point, Vec3::Zero(), 60 * ms, 0.0);
  EXPECT_EQ(stale.share(), 0.0);
}

TEST(StaleSolution, ARadiusThatIsNoneIsZero) {
  for (const double radius : {nan, -1.0, 0.0}) {
    DeviceCommand solution = spring();
    solution.local.radius = radius;
    StaleSolution stale({});
    EXPECT_EQ(stale.force(solution, Vec3(1, 2, 3), Vec3::Zero(), 0.0, ms), solution.wrench.force);
  }
}

TEST(SpeedLimit, SeesWhatTheDeviceSaysAndWhereItCame) {
  SpeedLimit limit(1.0, ms);
  DeviceState fast = report(1);
  fast.velocity = Vec3(0.6, 0.8, 0.01);
  limit.see(fast);
  EXPECT_TRUE(limit.failed());
  limit.reset();
  limit.see(report(1));
  limit.see(report(2, Vec3(0.0009, 0, 0)));
  EXPECT_FALSE(limit.failed());
  EXPECT_NEAR(limit.speed(), 0.9, 1e-9);
  limit.see(report(3, Vec3(0.0021, 0, 0)));
  EXPECT_TRUE(limit.failed());
}

TEST(SpeedLimit, ReportsThatWereLostOrComeTogetherAreNoJump) {
  SpeedLimit limit(1.0, ms);
  limit.see(report(1));
  DeviceState late = report(5, Vec3(0.003, 0, 0));  // 4 ms at 0.75 m/s
  late.arrived = 1 * ms_ns + 100'000;
  limit.see(late);
  EXPECT_FALSE(limit.failed());
  EXPECT_NEAR(limit.speed(), 0.75, 1e-9);
}

TEST(FlipCounter, CountsChangesOfSideWithinTheWindow) {
  FlipCounter counter(1.0, 0.1);
  int count = 0;
  for (int k = 0; k < 10; ++k) count = counter.count(Vec3(0, k % 2 == 0 ? 2.0 : -2.0, 0), k * ms_ns);
  EXPECT_EQ(count, 9);
  EXPECT_EQ(counter.count(Vec3::Zero(), 101 * ms_ns), 9);
  EXPECT_EQ(counter.count(Vec3::Zero(), 105 * ms_ns), 5);  // of 1 to 9 ms those from 5 ms
  for (int k = 0; k < 100; ++k) count = counter.count(Vec3(k % 2 == 0 ? 0.9 : -0.9, 0, 0), (300 + k) * ms_ns);
  EXPECT_EQ(count, 0);
}

/// Half a second of a swinging hand or force.
BuzzDetector swing(double frequency, double speed, double force, double time = 0.5) {
  BuzzDetector buzz({.window = 0.25, .flips = 10, .fade = 0.2});
  for (int k = 0; k * ms < time; ++k) {
    const double wave = std::sin(2.0 * M_PI * frequency * k * ms);
    buzz.see(Vec3(speed * wave, 0, 0), Vec3(0, 0, 1.0 + force * wave), k * ms_ns, ms);
  }
  return buzz;
}

TEST(BuzzDetector, TellsBuzzFromHand) {
  EXPECT_TRUE(swing(40.0, 0.05, 0.0).buzzing());    // a limit cycle
  EXPECT_TRUE(swing(40.0, 0.0, 0.8).buzzing());     // seen in the force only
  EXPECT_FALSE(swing(8.0, 0.3, 0.8).buzzing());     // a hand that shakes as it can
  EXPECT_FALSE(swing(12.0, 0.008, 0.0).buzzing());  // tremor
  EXPECT_FALSE(swing(40.0, 0.015, 0.2).buzzing());  // too small to be felt as harm
  EXPECT_EQ(swing(8.0, 0.3, 0.8).share(), 1.0);
}

TEST(BuzzDetector, FadesThenFails) {
  EXPECT_LT(swing(40.0, 0.05, 0.0, 0.2).share(), 0.8);
  EXPECT_FALSE(swing(40.0, 0.05, 0.0, 0.2).failed());
  EXPECT_TRUE(swing(40.0, 0.05, 0.0, 0.5).failed());
}

TEST(BuzzDetector, ForceComesBackWhenItEnds) {
  BuzzDetector buzz = swing(40.0, 0.05, 0.0, 0.2);
  const double left = buzz.share();
  for (int k = 200; k < 2000; ++k) buzz.see(Vec3::Zero(), Vec3(0, 0, 1), k * ms_ns, ms);
  EXPECT_FALSE(buzz.buzzing());
  EXPECT_GT(left, 0.0);
  EXPECT_EQ(buzz.share(), 1.0);
}

TEST(BuzzDetector, AHandThatShakesInTheAirIsItsOwnAffair) {
  BuzzDetector buzz({});
  for (int k = 0; k < 1000; ++k) buzz.see(Vec3(k % 10 < 5 ? 1.0 : -1.0, 0, 0), Vec3::Zero(), k * ms_ns, ms);
  EXPECT_FALSE(buzz.buzzing());
}

}  // namespace
}  // namespace palpate::rules_test
