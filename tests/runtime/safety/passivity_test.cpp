// Passivity observer and controller against closed formulas and a simulated device at a wall.
#include "runtime/safety/passivity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "runtime/safety/safety.h"

namespace palpate::passivity_test {
namespace {

constexpr double T = 0.001;  // s

/// A wall x > 0 of stiffness K that is moved into at constant speed and out again shows, in and out, forces
/// that differ by the hold: the hand gains what a damper K T / 2 would take. (Colgate and Brown's bound is
/// the same.)
TEST(Passivity, ObserverSeesTheEnergyOfTheHold) {
  const double K = 1000.0;
  const double v = 0.1;
  const int n = 50;
  Passivity observer(0.0, T);
  double x = 0.0;
  for (int k = 0; k < 2 * n; ++k) {
    observer.observe(Vec3(x, 0, 0));
    const double velocity = k < n ? v : -v;
    const Vec3 force(-K * x, 0, 0);
    EXPECT_EQ(observer.control(force, Vec3(velocity, 0, 0)), force);  // it only observes
    observer.set_displayed(force);
    x += velocity * T;
  }
  observer.observe(Vec3(x, 0, 0));
  EXPECT_NEAR(observer.energy(), -0.5 * K * T * v * v * (2 * n * T), 1e-12);
}

TEST(Passivity, ObserverTakesADamperAsDissipation) {
  const Vec3 velocity(0.1, -0.2, 0.05);
  Passivity observer(0.0, T);
  for (int k = 0; k <= 100; ++k) {
    observer.observe(k * T * velocity);
    observer.set_displayed(-3.0 * velocity);
  }
  EXPECT_NEAR(observer.energy(), 3.0 * velocity.squaredNorm() * 100 * T, 1e-12);
}

/// W = E - F . v T = -0.001 J; alpha = 0.001 / (0.001 s (0.5 m/s)^2) = 4 N s/m.
TEST(Passivity, ControllerAddsTheDampingOfTheFormula) {
  Passivity controller(10.0, T);
  controller.observe(Vec3::Zero());
  const Vec3 damped = controller.control(Vec3(2, 0, 0), Vec3(0.5, 0, 0));
  EXPECT_NEAR(controller.damping(), 4.0, 1e-12);
  EXPECT_TRUE(damped.isApprox(Vec3(2.0 - 4.0 * 0.5, 0, 0)) || damped.norm() < 1e-12);
  Passivity bounded(1.0, T);
  bounded.observe(Vec3::Zero());
  EXPECT_TRUE(bounded.control(Vec3(2, 0, 0), Vec3(0.5, 0, 0)).isApprox(Vec3(1.5, 0, 0)));
  EXPECT_EQ(bounded.damping(), 1.0);
}

TEST(Passivity, ControllerLetsASpringGiveBackWhatItTook) {
  Passivity controller(10.0, T);
  controller.observe(Vec3::Zero());
  controller.set_displayed(Vec3(-1, 0, 0));
  controller.observe(Vec3(0.01, 0, 0));  // 0.01 J went in
  EXPECT_NEAR(controller.energy(), 0.01, 1e-15);
  const Vec3 back(-1, 0, 0);
  EXPECT_EQ(controller.control(back, Vec3(-0.1, 0, 0)), back);
  EXPECT_EQ(controller.damping(), 0.0);
}

TEST(Passivity, OutOfContactNothingIsStored) {
  Passivity controller(10.0, T);
  controller.observe(Vec3::Zero());
  controller.set_displayed(Vec3(-1, 0, 0));
  controller.observe(Vec3(0.01, 0, 0));
  controller.control(Vec3::Zero(), Vec3::Zero());
  EXPECT_EQ(controller.energy(), 0.0);
  controller.set_displayed(Vec3(1, 0, 0));
  controller.observe(Vec3(0.02, 0, 0));  // but a debt stays
  controller.control(Vec3::Zero(), Vec3::Zero());
  EXPECT_NEAR(controller.energy(), -0.01, 1e-15);
}

/// A device of mass m that is pushed against a wall x < 0 with a constant force; exact between ticks.
struct Device {
  double mass = 0.1;  // kg
  double x = 0.002;   // m
  double v = -0.1;    // m/s

  void move(double force) {
    const double a = force / mass;
    x += v * T + 0.5 * a * T * T;
    v += a * T;
  }
  [[nodiscard]] double energy() const { return 0.5 * mass * v * v; }
};

constexpr double wall = 4000.0;  // N/m: K T / 2 = 2 N s/m, and the device has no damping at all

Vec3 wall_force(const Device& device) {
  return {-wall * std::min(device.x, 0.0), 0, 0};
}

/// Speed of the device after it came back from the wall, and whether the observer's energy was the device's.
double rebound(double max_damping) {
  Device device;
  const double before = device.energy();
  Passivity passivity(max_damping, T);
  for (int k = 0; k < 100; ++k) {
    passivity.observe(Vec3(device.x, 0, 0));
    EXPECT_NEAR(passivity.energy(), before - device.energy(), 1e-12);
    const Vec3 force = passivity.control(wall_force(device), Vec3(device.v, 0, 0));
    passivity.set_displayed(force);
    device.move(force.x());
  }
  EXPECT_GT(device.x, 0.0);
  return device.v;
}

TEST(Passivity, AWallThatIsTooStiffThrowsTheDeviceBackFasterWithoutIt) {
  EXPECT_GT(rebound(0.0), 1.02 * 0.1);
}

TEST(Passivity, ButNotWithIt) {
  const double speed = rebound(20.0);
  EXPECT_LT(speed, 1.0001 * 0.1);
  EXPECT_GT(speed, 0.9 * 0.1);  // nor is the wall a sponge
}

/// The same in Safety, the hand leaning on the device with 0.5 N: the energy of both in the last of three
/// seconds, at most, for one of the first.
double leaning_on_the_wall(double max_damping) {
  SafetyOptions options;
  options.max_force = 100.0;
  options.max_force_rate = 1e6;
  options.max_stiffness = 1e5;
  options.max_damping = max_damping;
  options.max_speed = 100.0;
  options.ramp = 0.0;
  options.buzz.flips = 1000;
  Safety safety(options);
  Device device;
  device.v = 0.0;
  const double first = 0.5 * device.x;
  double largest = 0.0;
  for (int k = 0; k < 3000; ++k) {
    const std::int64_t now = 1'000'000 * std::int64_t{k + 1};
    DeviceState state;
    state.pose.position = Vec3(device.x, 0, 0);
    state.velocity = Vec3(device.v, 0, 0);
    state.arrived = now;
    state.sequence = static_cast<std::uint32_t>(k);
    DeviceCommand wanted;
    wanted.wrench.force = wall_force(device);
    wanted.local.force = wanted.wrench.force;
    wanted.local.point = state.pose.position;
    const double force =
        safety.filter(state, wanted, {.now = now, .due = now, .solved = now}).wrench.force.x();
    EXPECT_EQ(safety.fault(), Fault::none);
    device.move(force - 0.5);
    if (k >= 2000) largest = std::max(largest, device.energy() + 0.5 * device.x);
  }
  return largest / first;
}

TEST(Passivity, LeaningOnTheWallGainsEnergyWithoutItAndNoneWithIt) {
  EXPECT_GT(leaning_on_the_wall(0.0), 10.0);
  EXPECT_LT(leaning_on_the_wall(20.0), 1.03);  // within the contact it is a tick ahead
}

}  // namespace
}  // namespace palpate::passivity_test
