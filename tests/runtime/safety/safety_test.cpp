// The rules together: what the hand has in each fault, and what holds whatever comes in.
#include "runtime/safety/safety.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/error.h"

namespace palpate::safety_test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();
constexpr std::int64_t ms_ns = 1'000'000;  // ns

static_assert(std::is_trivially_copyable_v<TickTiming>);
static_assert(std::is_copy_constructible_v<Safety> && std::is_copy_assignable_v<Safety>);
static_assert(noexcept(std::declval<Safety&>().filter(std::declval<const DeviceState&>(),
                                                      std::declval<const DeviceCommand&>(),
                                                      std::declval<const TickTiming&>())));

SafetyOptions quick() {
  SafetyOptions options;
  options.ramp = 0.1;
  return options;
}

/// A device that rests, a solver that is in time, and Safety between them.
struct Bench {
  explicit Bench(const SafetyOptions& options = quick(), const DeviceLimits& limits = {})
      : safety(options, limits) {
    wanted.local.radius = 0.001;
  }

  DeviceCommand tick() {
    now += ms_ns;
    if (talks) ++device.sequence;
    device.arrived = now + lateness;
    if (moves) device.pose.position.x() = 1e-6 * std::sin(static_cast<double>(device.sequence));
    if (solves) {
      solved = now;
      wanted.local.force = wanted.wrench.force;
      wanted.local.point = device.pose.position;
    }
    last = safety.filter(device, wanted,
                         {.now = now + lateness, .due = now, .solved = solved, .inside_body = inside});
    return last;
  }

  void ticks(int count) {
    for (int k = 0; k < count; ++k) tick();
  }

  /// Engaged, its ramp done, with `force` on z.
  void press(double force) {
    ticks(120);
    EXPECT_EQ(safety.phase(), SafetyPhase::active);
    wanted.wrench.force = Vec3(0, 0, force);
    ticks(50);
    EXPECT_NEAR(last.wrench.force.z(), std::min(force, 3.0), 1e-12);
  }

  Safety safety;
  std::int64_t now = 1'000'000'000;
  std::int64_t lateness = 0;
  std::int64_t solved = 0;
  DeviceState device;
  DeviceCommand wanted;
  DeviceCommand last;
  bool talks = true;
  bool solves = true;
  bool moves = true;
  bool inside = false;
};

double force_of(const DeviceCommand& command) {
  return command.wrench.force.norm();
}

void expect_nothing(const DeviceCommand& command) {
  EXPECT_EQ(command.wrench.force, Vec3::Zero());
  EXPECT_EQ(command.wrench.torque, Vec3::Zero());
  EXPECT_EQ(command.local.force, Vec3::Zero());
  EXPECT_EQ(command.local.stiffness, Mat3::Zero());
}

TEST(Safety, ForceBeginsFromZeroAndGrowsSteadily) {
  SafetyOptions options = quick();
  options.max_force_rate = 1e6;
  Bench bench(options);
  bench.ticks(11);
  EXPECT_EQ(bench.safety.phase(), SafetyPhase::ramping);
  bench.wanted.wrench.force = Vec3(0, 0, 2);
  double before = 0.0;
  double share = bench.safety.share();
  while (bench.safety.phase() == SafetyPhase::ramping) {
    const double force = force_of(bench.tick());
    EXPECT_NEAR(bench.safety.share() - share, 0.01, 1e-9);  // 1 ms of 100
    EXPECT_NEAR(force, 2.0 * bench.safety.share(), 1e-12);
    EXPECT_GE(force, before);
    before = force;
    share = bench.safety.share();
    ASSERT_LT(bench.now, 2'000'000'000);
  }
  EXPECT_NEAR(force_of(bench.last), 2.0, 1e-9);
  EXPECT_EQ(bench.safety.phase(), SafetyPhase::active);
}

TEST(Safety, DoesNotEngageInContactOrInTheBody) {
  Bench bench;
  bench.wanted.wrench.force = Vec3(0, 0, 1);
  for (int k = 0; k < 500; ++k) expect_nothing(bench.tick());
  bench.wanted.wrench.force.setZero();
  bench.inside = true;
  for (int k = 0; k < 500; ++k) expect_nothing(bench.tick());
  EXPECT_EQ(bench.safety.phase(), SafetyPhase::waiting);
  bench.inside = false;
  bench.press(1.0);
}

TEST(Safety, LetsThroughWhatIsHarmless) {
  Bench bench;
  bench.wanted.local.stiffness = Vec3(100.0, 200.0, 300.0).asDiagonal();
  bench.wanted.local.radius = 0.001;
  bench.press(1.0);
  EXPECT_EQ(bench.last.wrench.force, Vec3(0, 0, 1));
  EXPECT_EQ(bench.last.local.force, Vec3(0, 0, 1));
  EXPECT_TRUE(bench.last.local.stiffness.isApprox(bench.wanted.local.stiffness, 1e-6));
  EXPECT_EQ(bench.last.local.point, bench.device.pose.position);
  EXPECT_NEAR(bench.last.local.radius, 0.001, 2e-6);
}

TEST(Safety, ClampsForceTorqueAndTheirRates) {
  Bench bench;
  bench.wanted.local.stiffness = 100.0 * Mat3::Identity();
  bench.press(0.05);
  bench.wanted.wrench.force = Vec3(0, 1e60, 0);
  bench.wanted.wrench.torque = Vec3(1e60, 0, 0);
  Wrench before = bench.last.wrench;
  for (int k = 0; k < 100; ++k) {
    const Wrench now = bench.tick().wrench;
    EXPECT_LE((now.force - before.force).norm(), 0.5 + 1e-12);
    EXPECT_LE((now.torque - before.torque).norm(), 0.01 + 1e-12);
    before = now;
  }
  EXPECT_TRUE(before.force.isApprox(Vec3(0, 3, 0)));
  EXPECT_TRUE(before.torque.isApprox(Vec3(0.1, 0, 0)));
  EXPECT_EQ(bench.last.local.stiffness, Mat3::Zero());
}

TEST(Safety, KeepsTheDevicesLimitsWhereTheyAreLower) {
  Bench bench(quick(), {.max_force = 2.0, .max_torque = 0.05, .max_stiffness = 400.0});
  bench.wanted.local.stiffness = 1000.0 * Mat3::Identity();
  bench.wanted.local.radius = 1.0;
  bench.ticks(120);
  bench.wanted.wrench.force = Vec3(0, 0, 1);
  bench.ticks(50);
  EXPECT_NEAR(bench.last.local.stiffness.trace(), 3 * 400.0, 1e-3);
  // Within its radius the field is no stronger than the clamp.
  EXPECT_LE(1.0 + 400.0 * bench.last.local.radius, 2.0 + 1e-9);
  EXPECT_GT(bench.last.local.radius, 0.001);
  bench.wanted.wrench.force = Vec3(0, 0, 100);
  bench.wanted.wrench.torque = Vec3(0, 0, 100);
  bench.ticks(50);
  EXPECT_NEAR(force_of(bench.last), 2.0, 1e-12);
  EXPECT_NEAR(bench.last.wrench.torque.norm(), 0.05, 1e-12);
}

TEST(Safety, ADeviceThatFallsSilentFadesThenFaults) {
  Bench bench;
  bench.press(2.0);
  bench.talks = false;
  double before = 2.0;
  for (int k = 1; k <= 20; ++k) {
    const double force = force_of(bench.tick());
    EXPECT_NEAR(force, 2.0 * std::min(1.0, (20.0 - k) / 15.0), 1e-9) << k;
    EXPECT_LE(force, before + 1e-12);
    before = force;
    EXPECT_EQ(bench.safety.fault(), Fault::none);
  }
  expect_nothing(bench.tick());
  EXPECT_EQ(bench.safety.fault(), Fault::device_silent);
}

/// What the passivity controller takes back is of a velocity that nobody knows any more.
TEST(Safety, DampingFadesWithASilentDevice) {
  Bench bench;
  bench.press(3.0);
  bench.device.velocity = Vec3(0, 0, 0.3);
  for (int k = 0; k < 30; ++k) {  // pushed along by more than damping can hold
    bench.device.pose.position.z() += 0.0003;
    bench.tick();
  }
  bench.wanted.wrench.force.setZero();
  bench.ticks(10);
  EXPECT_LT(bench.safety.energy(), 0.0);
  EXPECT_NEAR(bench.last.wrench.force.z(), -5.0 * 0.3, 1e-9);
  bench.talks = false;
  for (int k = 1; k <= 20; ++k)
    EXPECT_NEAR(bench.tick().wrench.force.z(), -1.5 * std::min(1.0, (20.0 - k) / 15.0), 1e-9) << k;
}

TEST(Safety, FrozenNumbersFault) {
  Bench bench;
  bench.press(2.0);
  bench.moves = false;
  bench.ticks(300);
  EXPECT_EQ(bench.safety.fault(), Fault::device_frozen);
}

TEST(Safety, AHandThatIsTooFastFaults) {
  Bench bench;
  bench.press(2.0);
  bench.device.velocity = Vec3(0, 1.1, 0);
  expect_nothing(bench.tick());
  EXPECT_EQ(bench.safety.fault(), Fault::too_fast);
}

TEST(Safety, APoseThatIsNoNumberIsSilence) {
  Bench bench;
  bench.press(2.0);
  bench.device.pose.position.y() = nan;
  bench.ticks(3);
  EXPECT_EQ(bench.safety.fault(), Fault::none);
  EXPECT_NEAR(force_of(bench.last), 2.0, 1e-12);
  bench.device.pose.position.y() = 0.0;
  bench.ticks(3);
  EXPECT_EQ(bench.safety.fault(), Fault::none);
  bench.device.velocity.y() = inf;
  bench.ticks(21);
  EXPECT_EQ(bench.safety.fault(), Fault::device_silent);
}

TEST(Safety, LateTicksFadeThenFault) {
  Bench bench;
  bench.press(2.0);
  bench.lateness = ms_ns;
  bench.ticks(3);
  EXPECT_LT(force_of(bench.last), 1.0);
  EXPECT_GT(force_of(bench.last), 0.0);
  EXPECT_EQ(bench.safety.fault(), Fault::none);
  bench.ticks(3);
  EXPECT_EQ(force_of(bench.last), 0.0);
  EXPECT_EQ(bench.safety.fault(), Fault::none);
  bench.ticks(6);
  EXPECT_EQ(bench.safety.fault(), Fault::deadline_missed);
}

/// On a busy machine the beginning is where ticks and reports are late, and nobody has felt anything.
TEST(Safety, BeforeAnythingIsFeltWhatIsLateBeginsTheStartAnew) {
  Bench bench;
  bench.ticks(120);
  EXPECT_EQ(bench.safety.phase(), SafetyPhase::active);
  bench.lateness = ms_ns;
  bench.ticks(12);
  EXPECT_EQ(bench.safety.fault(), Fault::none);
  EXPECT_EQ(bench.safety.phase(), SafetyPhase::waiting);
  bench.lateness = 0;
  bench.ticks(120);
  bench.talks = false;
  bench.ticks(30);
  EXPECT_EQ(bench.safety.fault(), Fault::none);
  EXPECT_EQ(bench.safety.phase(), SafetyPhase::waiting);
  bench.wanted.wrench.force = Vec3(0, 0, 2);  // it is heard of again in contact
  bench.talks = true;
  for (int k = 0; k < 200; ++k) expect_nothing(bench.tick());
  bench.wanted.wrench.force.setZero();
  bench.press(2.0);
  bench.talks = false;
  bench.ticks(30);
  EXPECT_EQ(bench.safety.fault(), Fault::device_silent);
}

TEST(Safety, AfterAnAcknowledgementNothingHasBeenFeltYet) {
  Bench bench;
  bench.press(2.0);
  bench.lateness = ms_ns;
  bench.ticks(12);
  EXPECT_EQ(bench.safety.fault(), Fault::deadline_missed);
  bench.safety.acknowledge();
  bench.wanted.wrench.force.setZero();
  bench.ticks(30);
  EXPECT_EQ(bench.safety.fault(), Fault::none);
  bench.lateness = 0;
  bench.press(2.0);
  bench.lateness = ms_ns;
  bench.ticks(12);
  EXPECT_EQ(bench.safety.fault(), Fault::deadline_missed);
}

/// A stall of 50 ms, after which the loop goes on: one gap, one fault, no force.
TEST(Safety, AStallOfTheLoopFaultsAtOnce) {
  Bench bench;
  bench.press(2.0);
  bench.lateness = 50 * ms_ns;
  expect_nothing(bench.tick());
  EXPECT_EQ(bench.safety.fault(), Fault::deadline_missed);
}

// While the loop hung the device let the force go: what comes after is not measured by what was before.
TEST(Safety, AfterAGapForceGrowsFromWhatTheDeviceWasLeftWith) {
  SafetyOptions options = quick();
  options.deadline.tolerance = 10.0;  // that rule would take it all
  options.max_force_rate = 100.0;
  for (const double gap : {0.005, 0.015, 0.020, 0.028}) {
    Bench bench(options);
    bench.press(2.0);
    bench.now += static_cast<std::int64_t>(1e9 * gap) - ms_ns;
    const double left = std::clamp(1.0 - (gap - 0.010) / 0.020, 0.0, 1.0);
    EXPECT_NEAR(force_of(bench.tick()), std::min(2.0, 2.0 * left + 0.1), 1e-3) << gap;
  }
  Bench bench(options);
  bench.press(2.0);
  bench.now += 100 * ms_ns;
  for (int k = 0; k < 100; ++k) ASSERT_EQ(force_of(bench.tick()), 0.0) << "in contact it must not begin";
  EXPECT_EQ(bench.safety.phase(), SafetyPhase::waiting);
}

TEST(Safety, AnOldSolutionIsExtrapolatedThenFadesThenBeginsAnew) {
  SafetyOptions options = quick();
  options.stale.damping = 0.0;
  Bench bench(options);
  bench.moves = false;
  bench.wanted.local.stiffness = 200.0 * Mat3::Identity();
  bench.wanted.local.radius = 0.01;
  bench.press(1.0);
  bench.solves = false;
  for (int k = 1; k <= 10; ++k) {
    bench.device.pose.position.z() = -1e-4 * k;
    EXPECT_NEAR(bench.tick().wrench.force.z(), 1.0 + 200.0 * 1e-4 * k, 1e-6) << k;
  }
  double before = force_of(bench.last);
  for (int k = 1; k <= 20; ++k) {
    const double force = force_of(bench.tick());
    EXPECT_NEAR(force, 1.2 * (1.0 - k / 20.0), 1e-6) << k;
    EXPECT_LT(force, before);
    before = force;
  }
  bench.tick();
  expect_nothing(bench.tick());
  EXPECT_EQ(bench.safety.fault(), Fault::none);
  EXPECT_EQ(bench.safety.phase(), SafetyPhase::waiting);
  bench.solves = true;
  for (int k = 0; k < 100; ++k) expect_nothing(bench.tick());  // in contact
  bench.wanted.wrench.force.setZero();
  bench.press(1.0);
}

TEST(Safety, AForceThatIsNoNumberIsAnOldSolution) {
  Bench bench;
  bench.press(1.0);
  bench.wanted.wrench.torque.z() = nan;
  bench.ticks(5);
  EXPECT_NEAR(force_of(bench.last), 1.0, 1e-9);
  bench.ticks(30);
  expect_nothing(bench.last);
}

TEST(Safety, BuzzFadesThenFaults) {
  Bench bench;
  bench.press(2.0);
  double largest_late = 0.0;
  int k = 0;
  for (; k < 1000 && bench.safety.fault() == Fault::none; ++k) {
    bench.device.velocity.z() = k % 20 < 10 ? 0.05 : -0.05;  // 50 Hz
    bench.tick();
    if (k >= 250) largest_late = std::max(largest_late, force_of(bench.last));
  }
  EXPECT_EQ(bench.safety.fault(), Fault::buzzing);
  EXPECT_LT(largest_late, 1.0);
  EXPECT_LT(k, 500);
}

TEST(Safety, TheFirstFaultIsLatchedAndAcknowledgedWithARamp) {
  Bench bench;
  bench.press(2.0);
  bench.safety.fail(Fault::input_lost);
  bench.safety.fail(Fault::device_lost);
  EXPECT_EQ(bench.safety.fault(), Fault::input_lost);
  for (int k = 0; k < 100; ++k) expect_nothing(bench.tick());
  bench.safety.restart();
  for (int k = 0; k < 100; ++k) expect_nothing(bench.tick());
  EXPECT_EQ(bench.safety.phase(), SafetyPhase::faulted);
  bench.safety.acknowledge();
  EXPECT_EQ(bench.safety.fault(), Fault::none);
  for (int k = 0; k < 100; ++k) expect_nothing(bench.tick());  // in contact
  bench.wanted.wrench.force.setZero();
  bench.ticks(12);
  EXPECT_EQ(bench.safety.phase(), SafetyPhase::ramping);
  bench.press(2.0);
}

TEST(Safety, APauseIsARampAndNoFault) {
  Bench bench;
  bench.press(2.0);
  bench.now += 5'000 * ms_ns;
  bench.device.sequence = 0;  // re-plugged
  bench.safety.restart();
  expect_nothing(bench.tick());
  EXPECT_EQ(bench.safety.fault(), Fault::none);
  EXPECT_EQ(bench.safety.phase(), SafetyPhase::waiting);
  bench.wanted.wrench.force.setZero();
  bench.press(2.0);
}

TEST(Safety, ShutDownIsForEver) {
  Bench bench;
  bench.press(2.0);
  bench.safety.shut_down();
  expect_nothing(bench.tick());
  bench.safety.acknowledge();
  bench.safety.restart();
  bench.safety.fail(Fault::stopped);
  bench.safety.acknowledge();
  bench.wanted.wrench.force.setZero();
  for (int k = 0; k < 300; ++k) expect_nothing(bench.tick());
  EXPECT_EQ(bench.safety.phase(), SafetyPhase::shut_down);
}

TEST(Safety, CopiesGoOnAlike) {
  Bench bench;
  bench.press(2.0);
  Bench copy = bench;
  for (int k = 0; k < 100; ++k) {
    bench.device.velocity = copy.device.velocity = Vec3(0, 0, 0.03 * std::cos(0.3 * k));
    EXPECT_EQ(bench.tick().wrench.force, copy.tick().wrench.force);
  }
}

TEST(Safety, RefusesOptionsWithoutSense) {
  const auto refused = [](auto change) {
    SafetyOptions options;
    change(options);
    EXPECT_THROW(Safety{options}, Error);
  };
  refused([](SafetyOptions& o) { o.max_force = -1.0; });
  refused([](SafetyOptions& o) { o.max_force = nan; });
  refused([](SafetyOptions& o) { o.max_force_rate = inf; });
  refused([](SafetyOptions& o) { o.period = 0.0; });
  refused([](SafetyOptions& o) { o.stale.fade = 0.0; });
  refused([](SafetyOptions& o) { o.silence.fade_from = o.silence.most; });
  refused([](SafetyOptions& o) { o.buzz.flips = 0; });
}

TEST(Fault, NamesAreTheirOwn) {
  std::set<std::string> names;
  for (std::size_t k = 0; k < fault_names.size(); ++k) {
    EXPECT_EQ(static_cast<std::size_t>(fault_names[k].first), k);
    names.insert(fault_names[k].second);
  }
  EXPECT_EQ(names.size(), fault_names.size());
}

/// A session of which anything may be wrong; after each tick what always holds is checked.
class Chaos {
 public:
  explicit Chaos(unsigned seed) : random_(seed) {}

  /// `event`: what goes wrong, for `count` ticks. Returns what does not hold, or "".
  std::string run(int event, int count) {
    for (int k = 0; k < count; ++k) {
      const std::string wrong = tick(event);
      if (!wrong.empty()) return wrong + " in event " + std::to_string(event);
    }
    return "";
  }

  static constexpr int events = 24;
  int ticks_with_force = 0;
  int ticks = 0;

 private:
  double number() { return std::normal_distribution<double>()(random_); }
  double any() {
    const double strange[] = {nan, inf, -inf, 1e308, -1e99, 1e60, 0.0, 1e-320};
    return strange[random_() % 8];
  }
  Vec3 vector(double size) { return size * Vec3(number(), number(), number()); }
  std::int64_t any_time() { return static_cast<std::int64_t>(random_()); }

  std::string tick(int event) {
    DeviceState device = device_;
    device_.velocity = 0.98 * device_.velocity + vector(0.01);
    device_.pose.position += 0.001 * device_.velocity;
    device_.sequence += 1;
    now_ += 1'000'000 + static_cast<std::int64_t>(random_() % 20'000) - 10'000;
    device_.arrived = now_ - 100'000;
    device = device_;
    DeviceCommand wanted;
    const Vec3 depth = (phase_++ % 400) < 200 ? Vec3(Vec3::Zero()) : device_.pose.position;
    wanted.wrench.force = -300.0 * depth;
    wanted.wrench.torque = 10.0 * depth;
    wanted.local = {.force = wanted.wrench.force,
                    .stiffness = 300.0 * Mat3::Identity(),
                    .point = device_.pose.position,
                    .radius = 0.005};
    TickTiming timing{.now = now_, .due = now_, .solved = now_ - 50'000};
    bool restarted = false;
    switch (event) {
      case 0:
        device.pose.position[0] = any();
        break;
      case 1:
        device.velocity[1] = any();
        break;
      case 2:
        device.pose.orientation.w() = any();
        break;
      case 3:
        device.pose.position += vector(1.0);
        break;
      case 4:
        device.sequence -= 5;
        break;
      case 5:
        device.sequence = static_cast<std::uint32_t>(random_());
        break;
      case 6:
        wanted.wrench.force = vector(1000.0);
        break;
      case 7:
        wanted.wrench.force[2] = any();
        break;
      case 8:
        wanted.wrench.torque[0] = any();
        break;
      case 9:
        wanted.local.stiffness(1, 0) = any();
        break;
      case 10:
        wanted.local.stiffness = 1e5 * (Mat3::Random() + 2.0 * Mat3::Identity());
        break;
      case 11:
        wanted.local.radius = any();
        break;
      case 12:
        wanted.local.point = vector(1.0);
        break;
      case 13:
        timing.due = now_ - 800'000;
        break;
      case 14:
        timing.due = any_time();
        break;
      case 15:
        timing.now = any_time();
        break;
      case 16:
        timing.solved = now_ - static_cast<std::int64_t>(random_() % 50'000'000);
        break;
      case 17:
        timing.solved = any_time();
        break;
      case 18:
        timing.inside_body = true;
        break;
      case 19:
        device.pose.position = last_position_;
        device.velocity.setZero();
        break;
      case 20:
        safety_.restart();
        restarted = true;
        break;
      case 21:
        safety_.fail(Fault::stopped);
        break;
      case 22:
        wanted.wrench.torque = vector(100.0);
        break;
      default:
        break;
    }
    last_position_ = device.pose.position;
    if (safety_.fault() != Fault::none && random_() % 50 == 0) {
      safety_.acknowledge();
      restarted = true;
    }
    const double passed =
        std::clamp(1e-9 * (static_cast<double>(timing.now) - static_cast<double>(last_now_)), 0.0, 0.001);
    // In a gap the device lets the force fade by itself.
    const double gap =
        std::max(0.0, 1e-9 * (static_cast<double>(timing.now) - static_cast<double>(last_now_)));
    const StaleOptions stale;
    const double left = std::clamp(1.0 - (gap - stale.time_to_live) / stale.fade, 0.0, 1.0);
    before_.force *= left;
    before_.torque *= left;
    last_now_ = timing.now;
    if (restarted) before_ = Wrench{};
    const double ramp = safety_.ramp();
    const DeviceCommand out = safety_.filter(device, wanted, timing);
    const std::string wrong = check(out, restarted ? 0.001 : passed);
    before_ = out.wrench;
    if (safety_.ramp() < ramp && safety_.ramp() != 0.0) return "the ramp fell, and not to zero";
    ++ticks;
    if (out.wrench.force != Vec3::Zero()) ++ticks_with_force;
    return wrong;
  }

  std::string check(const DeviceCommand& out, double passed) const {
    constexpr double rounding = 1.0 + 1e-12;
    const SafetyOptions options;
    if (!out.wrench.force.allFinite() || !out.wrench.torque.allFinite() || !out.local.force.allFinite() ||
        !out.local.stiffness.allFinite() || !out.local.point.allFinite() || !std::isfinite(out.local.radius))
      return "not finite";
    if (out.wrench.force.norm() > options.max_force * rounding) return "too much force";
    if (out.wrench.torque.norm() > options.max_torque * rounding) return "too much torque";
    if (out.local.force != out.wrench.force) return "a local model of another force";
    if (out.local.stiffness.norm() > 1.8 * options.max_stiffness) return "too stiff";
    if (out.local.radius < 0.0) return "a radius below 0";
    if (safety_.fault() != Fault::none) {
      return out.wrench.force == Vec3::Zero() && out.wrench.torque == Vec3::Zero() &&
                     out.local.stiffness == Mat3::Zero()
                 ? ""
                 : "force in spite of a fault";
    }
    if ((out.wrench.force - before_.force).norm() > options.max_force_rate * passed + 1e-9) return "a kick";
    if ((out.wrench.torque - before_.torque).norm() > options.max_torque_rate * passed + 1e-9)
      return "a kick of the torque";
    if (out.wrench.force.norm() + out.local.radius * out.local.stiffness.norm() >
        options.max_force * rounding + 1e-9)
      return "a field that is too strong";
    return "";
  }

  static SafetyOptions safety_options() {
    SafetyOptions options;
    options.ramp = 0.2;
    return options;
  }

  std::mt19937_64 random_;
  Safety safety_{safety_options()};
  DeviceState device_;
  Vec3 last_position_ = Vec3::Zero();
  Wrench before_;
  std::int64_t now_ = 1'000'000'000;
  std::int64_t last_now_ = now_;
  int phase_ = 0;
};

RC_GTEST_PROP(Safety, KeepsItsPromisesWhateverComesIn,
              (unsigned seed, const std::vector<std::uint8_t>& faults)) {
  Chaos chaos(seed);
  RC_ASSERT(chaos.run(Chaos::events - 1, 450) == "");
  for (const std::uint8_t fault : faults) {
    RC_ASSERT(chaos.run(fault % Chaos::events, 1 + fault / 8) == "");
    RC_ASSERT(chaos.run(Chaos::events - 1, 40) == "");
  }
  RC_ASSERT(chaos.run(Chaos::events - 1, 100) == "");
}

/// Each event long and after calm; and that the above is about force at all.
TEST(Safety, ChaosIsOfForces) {
  int shown = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    for (int event = 0; event < Chaos::events; ++event) {
      Chaos chaos(1000 * seed + static_cast<unsigned>(event));
      EXPECT_EQ(chaos.run(Chaos::events - 1, 370), "");
      EXPECT_GT(chaos.ticks_with_force, 50);
      EXPECT_EQ(chaos.run(event, 100), "");
      EXPECT_EQ(chaos.run(Chaos::events - 1, 500), "");
      shown += chaos.ticks_with_force;
    }
  }
  EXPECT_GT(shown, 20 * Chaos::events * 150);
}

}  // namespace
}  // namespace palpate::safety_test
