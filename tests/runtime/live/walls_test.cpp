// Bodies thrown at walls.
#include "runtime/live/walls.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>
#include <string>

#include "base/error.h"
#include "runtime/live/live_stepper.h"
#include "tests/support/bodies/live_bodies.h"
#include "tests/support/bodies/thrown_bodies.h"

namespace palpate::walls_test {
namespace {

using test::momenta_of;
using test::throw_body;

constexpr double g = 9.81;

/// A stiffer block than others of the tests, of 20 x 20 x 10 mm.
LiveInput stone(ElementType type) {
  const Material material{.youngs_modulus = 1e5, .poissons_ratio = 0.3, .density = 1000.0};
  if (type == ElementType::tri3)
    return test::live_input_of(generate(RectangleShape{Vec3::Zero(), {0.02, 0.01, 0}, {4, 2}}, type),
                               material, Analysis::plane_strain);
  return test::live_input_of(generate(BoxShape{Vec3::Zero(), Vec3(0.02, 0.02, 0.01), {2, 2, 1}}), material);
}

/// How fast a block goes down an incline after a time, of what the slope lets it [-].
double sliding(ElementType type, Integrator integrator, double h, double mu, double tangent,
               const Rayleigh& damping) {
  const int d = type == ElementType::tri3 ? 2 : 3;
  const double angle = std::atan(tangent), time = 2.0;
  const Vec3 up = Vec3::Unit(d - 1), along = Vec3::UnitX();
  const LiveBody body(stone(type),
                      {.damping = damping, .gravity = g * (std::sin(angle) * along - std::cos(angle) * up)});
  LiveStepper stepper(body, {.time_step = h,
                             .scheme = {.integrator = integrator},
                             .walls = {{.normal = up, .offset = 0.0, .friction = mu}}});
  LiveState state(body);
  for (int k = 0; k < time / h; ++k) EXPECT_TRUE(stepper.step(state).whole);
  double mass = 0.0;
  for (Eigen::Index k = 0; k < body.dofs(); k += d) mass += body.mass()[k];
  return momenta_of(body, state).linear.x() / mass / (g * std::cos(angle) * mu * time);
}

TEST(Walls, ABlockBeginsToSlideAtTheFrictionAngle) {
  for (const ElementType type : {ElementType::tet4, ElementType::tri3}) {
    for (const double mu : {0.3, 0.8}) {
      EXPECT_LT(
          std::abs(sliding(type, Integrator::implicit_euler, 4e-3, mu, 0.995 * mu, {.stiffness = 2e-3})),
          2e-5)
          << mu;
      const double speed =
          sliding(type, Integrator::implicit_euler, 4e-3, mu, 1.005 * mu, {.stiffness = 2e-3});
      EXPECT_NEAR(speed / 0.005, 1.0, 0.1) << mu;  // v = g (sin - mu cos) t
    }
  }
}

/// How fast a free cube of 40 x 40 x 30 mm still moves along an incline of friction 0.5 after a second [m/s].
double creep(const std::array<int, 3>& cells, double youngs_modulus, Integrator integrator, double h,
             double degrees) {
  const double angle = degrees * std::numbers::pi / 180.0;
  const Material material{.youngs_modulus = youngs_modulus, .poissons_ratio = 0.3, .density = 1000.0};
  const LiveBody body(
      test::live_input_of(generate(BoxShape{Vec3::Zero(), Vec3(0.04, 0.04, 0.03), cells}, ElementType::hex8),
                          material),
      {.law = LiveLaw::corotational,
       .damping = {.stiffness = 1e-3},
       .gravity = g * Vec3(std::sin(angle), 0.0, -std::cos(angle))});
  LiveStepper stepper(body, {.time_step = h,
                             .scheme = {.integrator = integrator, .tolerance = 1e-5},
                             .walls = {{.normal = Vec3::UnitZ(), .offset = 0.0, .friction = 0.5}}});
  LiveState state(body);
  const auto along = [&] {
    double moment = 0.0, mass = 0.0;
    for (Eigen::Index k = 0; k < body.dofs(); k += 3) {
      moment += body.mass()[k] * state.x[k];
      mass += body.mass()[k];
    }
    return moment / mass;
  };
  const auto go = [&](double time) {
    for (int k = 0; k < std::lround(time / h); ++k) EXPECT_TRUE(stepper.step(state).whole);
  };
  go(1.0);
  const double before = along();
  go(0.2);
  return std::abs(along() - before) / 0.2;
}

TEST(Walls, ABlockRestsBelowTheFrictionAngle) {
  constexpr double still = 1e-5;  // [m/s]
  constexpr std::array<int, 3> coarse = {4, 4, 3}, fine = {6, 6, 4};
  for (const double degrees : {18.0, 22.0, 26.0}) {
    EXPECT_LT(creep(coarse, 5e4, Integrator::implicit_euler, 5e-3, degrees), still) << degrees;
    EXPECT_LT(creep(coarse, 5e4, Integrator::implicit_euler, 1e-2, degrees), still) << degrees;
  }
  EXPECT_LT(creep(coarse, 1e6, Integrator::implicit_euler, 5e-3, 20.0), still);
  EXPECT_LT(creep(coarse, 5e4, Integrator::midpoint, 5e-3, 22.0), still);
  EXPECT_LT(creep(fine, 5e4, Integrator::implicit_euler, 1e-2, 20.0), still);
}

// They slid at up to 1.3 m/s where their forces were those of a body within the floor.
TEST(Walls, ABlockRestsInExplicitStepsNearTheirLimitToo) {
  constexpr double still = 1e-5;  // [m/s]
  constexpr std::array<int, 3> cells = {4, 4, 3};
  EXPECT_LT(creep(cells, 5e4, Integrator::semi_implicit_euler, 2.5e-4, 22.0), still);
  EXPECT_LT(creep(cells, 5e4, Integrator::semi_implicit_euler, 5e-4, 22.0), still);
}

// Each node for itself. (A whole elastic block slides with some percent less: it shivers, as steady sliding
// with Coulomb's friction is unstable where nothing damps it, Adams 1995.)
TEST(Walls, NodesOfExplicitStepsHaveTheSameFriction) {
  const double mu = 0.5, h = 1e-3;
  const auto slid = [&](double tangent) {
    const Vec3 pull = g * Vec3(std::sin(std::atan(tangent)), 0.0, -std::cos(std::atan(tangent)));
    Vec3 x = Vec3::Zero(), v = Vec3::Zero();
    for (int k = 0; k < 2000; ++k) {
      const Vec3 from = x;
      v += h * pull;
      x += h * v;
      stop_at_walls({{.normal = Vec3::UnitZ(), .offset = 0.0, .friction = mu}}, from, h, x, v);
    }
    EXPECT_NEAR(x.z(), 0.0, 1e-15);
    return v.x() / (2.0 * g * std::cos(std::atan(tangent)));  // tan - mu
  };
  EXPECT_EQ(slid(0.995 * mu), 0.0);
  EXPECT_NEAR(slid(1.005 * mu), 0.005 * mu, 1e-12);
}

double lowest(const LiveState& state, int d) {
  double z = 1e9;
  for (Eigen::Index k = d - 1; k < state.x.size(); k += d) z = std::min(z, state.x[k]);
  return z;
}

TEST(Walls, NothingBouncesHigherThanItFell) {
  const LiveBody body(stone(ElementType::tet4), {.law = LiveLaw::corotational, .gravity = Vec3(0, 0, -g)});
  for (const Integrator integrator :
       {Integrator::semi_implicit_euler, Integrator::implicit_euler, Integrator::midpoint}) {
    const double h = is_implicit(integrator) ? 1e-3 : 1e-4;
    LiveStepper stepper(body, {.time_step = h,
                               .scheme = {.integrator = integrator},
                               .walls = {{.normal = Vec3::UnitZ(), .offset = 0.0, .friction = 0.3}}});
    LiveState state(body);
    const Mat3 turned = Eigen::AngleAxisd(0.5, Vec3(1, 2, 0).normalized()).toRotationMatrix();
    throw_body(body, turned, Vec3(0, 0, 0.05), Vec3::Zero(), Vec3::Zero(), state);
    const double fell = momenta_of(body, state).energy();
    double most = 0.0;
    bool touched = false;
    for (int k = 0; k < 0.6 / h; ++k) {
      const LiveReport report = stepper.step(state);
      ASSERT_TRUE(report.whole);
      touched = touched || report.contacts > 0;
      if (touched) most = std::max(most, momenta_of(body, state).energy());
      ASSERT_GT(lowest(state, 3), -1e-5) << name_of(integrator);
    }
    EXPECT_TRUE(touched);
    EXPECT_LT(most, 1.002 * fell) << name_of(integrator);
  }
}

/// What was wrong with a throw, empty where nothing was.
std::string throw_once(const LiveBody& body, unsigned seed) {
  const Vec3 low(0, 0, 0), high(0.1, 0.1, 0.15);
  StepperOptions options{
      .time_step = 5e-3, .scheme = {.tolerance = 1e-6}, .walls = room_walls(low, high, 0.4)};
  options.walls.push_back({.friction = 0.4, .box = {{Vec3(0.06, 0.06, -0.01), Vec3(0.11, 0.11, 0.02)}}});
  LiveStepper stepper(body, options);
  LiveState state(body);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  const auto vector = [&] { return Vec3(share(random), share(random), share(random)); };
  const Mat3 R = Eigen::Quaterniond(
                     Eigen::Vector4d(share(random), share(random), share(random), share(random)).normalized())
                     .toRotationMatrix();
  throw_body(body, R, Vec3(0.04, 0.04, 0.08) + 0.015 * vector(), 1.5 * vector(), 20.0 * vector(), state);
  double speed = 0.0;
  for (int k = 0; k < 800; ++k) {
    stepper.step(state);
    if (!state.x.allFinite() || !state.v.allFinite()) return "not finite";
    speed = state.v.cwiseAbs().maxCoeff();
    if (k > 100 && speed < 1e-4) break;
  }
  if (!(speed < 2e-3)) return "not at rest: " + std::to_string(speed) + " m/s";
  for (Eigen::Index k = 0; k < state.x.size(); k += 3) {
    const Vec3 x = state.x.segment<3>(k);
    if ((x - low).minCoeff() < -1e-4 || (high - x).head<2>().minCoeff() < -1e-4) return "in a wall";
  }
  return "";
}

// Set PALPATE_THROWS=10000 for the whole study.
TEST(Walls, RandomThrowsEndAtRestWithinThem) {
  const char* wanted = std::getenv("PALPATE_THROWS");
  const int throws = wanted != nullptr ? std::atoi(wanted) : 300;
  const Material material{.youngs_modulus = 2e4, .poissons_ratio = 0.35, .density = 1000.0};
  const LiveBody body(
      test::live_input_of(generate(BoxShape{Vec3::Zero(), Vec3(0.02, 0.02, 0.01), {2, 2, 1}}), material),
      {.plasticity = {.yield = 0.1, .creep = 5.0, .maximum = 0.3},
       .damping = {.mass = 0.5, .stiffness = 3e-3},
       .gravity = Vec3(0, 0, -g)});
  for (int k = 0; k < throws; ++k) EXPECT_EQ(throw_once(body, static_cast<unsigned>(k)), "") << "throw " << k;
}

TEST(Walls, BoxesAreMetThroughTheSideThatTheNodeCameFrom) {
  const Wall box{.box = {{Vec3(0, 0, 0), Vec3(1, 1, 0.2)}}};
  const auto above = gap_to(box, Vec3(0.5, 0.5, 0.3), Vec3(0.5, 0.5, 0.1));
  ASSERT_TRUE(above);
  EXPECT_NEAR(above->gap, -0.1, 1e-15);
  EXPECT_EQ(above->normal, Vec3::UnitZ());
  const auto beside = gap_to(box, Vec3(-0.1, 0.5, 0.1), Vec3(0.05, 0.5, 0.1));
  ASSERT_TRUE(beside);
  EXPECT_NEAR(beside->gap, -0.05, 1e-15);
  EXPECT_EQ(beside->normal, Vec3(-1, 0, 0));
  EXPECT_FALSE(gap_to(box, Vec3(2, 0.5, 0.3), Vec3(2, 0.5, -0.1)) &&
               gap_to(box, Vec3(2, 0.5, 0.3), Vec3(2, 0.5, -0.1))->gap < 0);
}

TEST(Walls, WithoutSenseAreRefused) {
  EXPECT_THROW(check_walls({{.normal = Vec3(0, 0, 2)}}), Error);
  EXPECT_THROW(check_walls({{.friction = -0.1}}), Error);
  EXPECT_THROW(check_walls({{.box = {{Vec3(1, 0, 0), Vec3(0, 1, 1)}}}}), Error);
}

}  // namespace
}  // namespace palpate::walls_test
