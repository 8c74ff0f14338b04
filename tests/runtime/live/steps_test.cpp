// Steps of live bodies: against the linear integrators of the study, and what each keeps.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>

#include "base/error.h"
#include "runtime/live/live_stepper.h"
#include "statics/balance.h"
#include "tests/support/bodies/dynamics_bodies.h"
#include "tests/support/bodies/live_bodies.h"
#include "tests/support/bodies/thrown_bodies.h"

namespace palpate::live_steps_test {
namespace {

using Eigen::VectorXd;
using test::Momenta;
using test::momenta_of;

constexpr std::array<Integrator, 3> all_integrators = {Integrator::semi_implicit_euler,
                                                       Integrator::implicit_euler, Integrator::midpoint};

StepperOptions options_of(Integrator integrator, double h) {
  return {.time_step = h, .scheme = {.integrator = integrator, .tolerance = 1e-12, .most_newton = 60}};
}

LiveInput clamped_block(ElementType type = ElementType::tet4) {
  LiveInput input = test::live_block(type);
  test::hold(
      input, [](const Vec3& x) { return x.x() < 1e-9; }, 7);
  return input;
}

/// u [d N] of a body that is pulled by `strain` along x and bent.
VectorXd pulled(const LiveBody& body, double strain) {
  VectorXd u = VectorXd::Zero(body.dofs());
  for (Eigen::Index k = 0; k < u.size(); k += body.dimension()) {
    const double x = body.rest()[k];
    u[k] = strain * x;
    u[k + 1] = 8.0 * strain * x * x;
  }
  return u;
}

TEST(LiveSteps, OfTheLinearLawAreThoseOfTheStudy) {
  const LiveInput input = clamped_block();
  test::ElasticCase block(input.mesh, input.materials[0]);
  block.hold([](const Vec3& x) { return x.x() < 1e-9; }, 7);
  for (const bool damped : {false, true}) {
    const Rayleigh damping = damped ? Rayleigh{.mass = 2.0, .stiffness = 1e-3} : Rayleigh{};
    const test::Equation equation = test::equation_of(block, true, damping);
    const LiveBody body(input, {.law = LiveLaw::linear, .damping = damping});
    ASSERT_EQ(equation.M.rows(), body.free_dofs());
    for (const auto& [integrator, method] :
         {std::pair(Integrator::semi_implicit_euler, test::Method::semi_implicit_euler),
          std::pair(Integrator::implicit_euler, test::Method::implicit_euler),
          std::pair(Integrator::midpoint, test::Method::newmark)}) {  // the same map where forces are linear
      const double h = is_implicit(integrator) ? 5e-3 : 2e-4;
      LiveStepper stepper(body, options_of(integrator, h));
      LiveState state(body);
      const VectorXd u = pulled(body, 0.01), v = 3.0 * u;
      state.x += u;
      state.v = v;
      const std::vector<Eigen::Index> free(body.dof_of_free().begin(), body.dof_of_free().end());
      const auto reference = test::make_integrator(method, equation, u(free), v(free), h);
      for (int k = 0; k < 20; ++k) {
        EXPECT_EQ(stepper.step(state).parts, 1);
        reference->step();
      }
      EXPECT_LT(((state.x - body.rest())(free)-reference->u()).norm(), 1e-9 * u.norm())
          << name_of(integrator);
      EXPECT_LT((state.v(free) - reference->v()).norm(), 1e-9 * reference->v().norm()) << name_of(integrator);
    }
  }
}

/// A block that turns and swings in space.
LiveState thrown(const LiveBody& body) {
  LiveState state(body);
  state.x += pulled(body, 0.05);
  test::throw_body(body, Mat3::Identity(), Vec3(1, 2, 0), Vec3(0.3, -0.2, 0.1), Vec3(4, 9, -7), state);
  return state;
}

TEST(LiveSteps, AFreeBodyKeepsItsMomenta) {
  for (const LiveLaw law : {LiveLaw::corotational, LiveLaw::neo_hookean}) {
    const LiveBody body(test::live_block(ElementType::tet4), {.law = law});
    for (const Integrator integrator : all_integrators) {
      LiveStepper stepper(body, options_of(integrator, is_implicit(integrator) ? 2e-3 : 2e-4));
      LiveState state = thrown(body);
      const Momenta before = momenta_of(body, state);
      for (int k = 0; k < 300; ++k) ASSERT_TRUE(stepper.step(state).whole);
      const Momenta after = momenta_of(body, state);
      EXPECT_LT((after.linear - before.linear).norm(), 1e-11 * before.linear.norm()) << name_of(integrator);
      if (integrator == Integrator::implicit_euler) continue;
      EXPECT_LT((after.angular - before.angular).norm(), 1e-10 * before.angular.norm())
          << name_of(integrator) << " " << name_of(law);
    }
  }
}

// Dents change nothing of it: the stress has the part that keeps moments in balance.
TEST(LiveSteps, APlasticBodyKeepsItsMomenta) {
  const LiveBody body(test::live_block(ElementType::tet4),
                      {.plasticity = {.yield = 0.01, .creep = 50.0, .maximum = 0.5}});
  LiveStepper stepper(body, options_of(Integrator::semi_implicit_euler, 2e-4));
  LiveState state = thrown(body);
  const Momenta before = momenta_of(body, state);
  for (int k = 0; k < 500; ++k) ASSERT_TRUE(stepper.step(state).whole);
  const Momenta after = momenta_of(body, state);
  EXPECT_GT(stepper.counts().plastic_work, 0.0);
  EXPECT_LT((after.linear - before.linear).norm(), 1e-11 * before.linear.norm());
  EXPECT_LT((after.angular - before.angular).norm(), 1e-10 * before.angular.norm());
}

/// The smallest and the largest energy in a second, of that at the beginning.
Eigen::Vector2d energy_range(Integrator integrator, double h) {
  const LiveBody body(clamped_block(), {.law = LiveLaw::corotational});
  LiveStepper stepper(body, options_of(integrator, h));
  LiveState state(body);
  state.x += pulled(body, 0.05);
  const double before = momenta_of(body, state).energy();
  Eigen::Vector2d range(1.0, 1.0);
  for (int k = 0; k < 1.0 / h; ++k) {
    if (!stepper.step(state).whole) return {-1.0, -1.0};
    const double share = momenta_of(body, state).energy() / before;
    range = {std::min(range[0], share), std::max(range[1], share)};
  }
  return range;
}

TEST(LiveSteps, EnergyGoesAsInTheStudy) {
  const Eigen::Vector2d semi = energy_range(Integrator::semi_implicit_euler, 4e-4),
                        implicit = energy_range(Integrator::implicit_euler, 4e-3),
                        midpoint = energy_range(Integrator::midpoint, 4e-3);
  EXPECT_GT(semi[0], 0.8);
  EXPECT_LT(semi[1], 1.2);
  EXPECT_LT(implicit[0], 0.2);
  EXPECT_LT(implicit[1], 1.0 + 1e-12);
  EXPECT_GT(midpoint[0], 0.9);
  EXPECT_LT(midpoint[1], 1.1);
}

TEST(LiveSteps, ABodyComesToRestWhereItsForcesBalance) {
  const LiveBody body(
      clamped_block(),
      {.law = LiveLaw::corotational, .damping = {.mass = 30.0}, .gravity = Vec3(0, 0, -9.81)});
  VectorXd x = body.start();
  ASSERT_TRUE(find_balance(body, body.load(), {}, x).converged);
  LiveStepper stepper(body, options_of(Integrator::implicit_euler, 0.02));
  LiveState state(body);
  for (int k = 0; k < 500; ++k) stepper.step(state);
  EXPECT_GT((x - body.rest()).norm(), 1e-3);
  EXPECT_LT((state.x - x).norm(), 1e-7 * (x - body.rest()).norm());
}

TEST(LiveSteps, ConjugateGradientsStepAsTheFactorDoes) {
  const LiveBody body(clamped_block(), {.law = LiveLaw::neo_hookean, .gravity = Vec3(0, 0, -9.81)});
  StepperOptions options = options_of(Integrator::implicit_euler, 5e-3);
  LiveStepper by_factor(body, options);
  options.scheme.solver.kind = SolverKind::conjugate_gradient;
  LiveStepper by_gradients(body, options);
  LiveState a(body), b(body);
  for (int k = 0; k < 60; ++k) {
    by_factor.step(a);
    by_gradients.step(b);
  }
  EXPECT_LT((a.x - b.x).norm(), 1e-8 * (a.x - body.rest()).norm());
  EXPECT_GT(by_gradients.solver().iterations(), 60);
  EXPECT_LT(by_gradients.solver().factorisations(), by_factor.solver().factorisations() / 5);
}

/// The longest stable step of a body at rest [s].
double limit_of(const LiveBody& body) {
  return longest_step_at(body, LargestFrequency(body).estimate(body.start(), {}, 300));
}

TEST(Limit, IsThatOfTheHighestMode) {
  const LiveInput input = clamped_block();
  const LiveBody free(input, {}), damped(input, {.damping = {.mass = 0.3, .stiffness = 0.3}});
  EXPECT_NEAR(longest_step_at(free, 10.0), 0.2, 1e-15);
  EXPECT_NEAR(longest_step_at(damped, 1.0), 2.0 * (std::sqrt(1.09) - 0.3), 1e-15);
  EXPECT_TRUE(std::isinf(longest_step_at(free, 0.0)));

  test::ElasticCase block(input.mesh, input.materials[0]);
  block.hold([](const Vec3& x) { return x.x() < 1e-9; }, 7);
  const double omega = test::all_modes(test::equation_of(block, true)).omega.maxCoeff();
  EXPECT_NEAR(limit_of(free) * omega, 2.0, 2e-3);
}

TEST(Limit, StepsBeyondItAreRefusedAndDiverge) {
  const LiveBody body(clamped_block(), {.law = LiveLaw::linear});
  const double limit = limit_of(body);
  EXPECT_THROW(LiveStepper(body, options_of(Integrator::semi_implicit_euler, 1.001 * limit)), Error);
  LiveStepper stepper(body, options_of(Integrator::semi_implicit_euler, 0.99 * limit));
  LiveState state(body);
  state.x += pulled(body, 0.01);
  const double before = momenta_of(body, state).energy();
  for (int k = 0; k < 1000; ++k) {
    const LiveReport report = stepper.step(state);
    ASSERT_TRUE(report.whole && report.parts == 1);
  }
  EXPECT_LT(momenta_of(body, state).energy(), 100.0 * before);
  // Not refused, it would grow.
  LiveState wild(body);
  wild.x += pulled(body, 0.01);
  VectorXd f;
  for (int k = 0; k < 1000; ++k) {
    internal_forces(body, wild.x, {}, f);
    for (const Index dof : body.dof_of_free()) wild.v[dof] += 1.02 * limit * f[dof] / body.mass()[dof];
    wild.x += 1.02 * limit * wild.v;
  }
  EXPECT_GT(momenta_of(body, wild).energy(), 1e6 * before);
  EXPECT_THROW(LiveStepper(body, options_of(Integrator::midpoint, 0.0)), Error);
}

// A pressed neo-Hookean body becomes stiffer than it was at rest: steps that were stable are cut and counted.
TEST(Limit, IsWatchedWhileTheBodyStiffens) {
  const LiveBody body(clamped_block(), {.law = LiveLaw::neo_hookean, .damping = {.mass = 20.0}});
  LiveStepper stepper(body, options_of(Integrator::semi_implicit_euler, 0.95 * limit_of(body)));
  LiveState state(body);
  VectorXd push = VectorXd::Zero(body.dofs());
  for (Eigen::Index k = 0; k < push.size(); k += 3) {
    if (body.rest()[k] > 0.04 - 1e-9) push[k] = -0.06;
  }
  int cut = 0;
  for (int k = 0; k < 2000; ++k) {
    const LiveReport report = stepper.step(state, std::min(k / 1000.0, 1.0) * push);
    ASSERT_TRUE(report.whole) << k;
    cut += report.parts > 1;
  }
  EXPECT_GT(cut, 100);
  EXPECT_EQ(stepper.counts().halved, cut);
  EXPECT_TRUE(state.x.allFinite());
}

// Its energy is 0 but for rounding, which has any sign. By how much rounding moves a stiff body differs
// between builds: of ours only that for AddressSanitizer exceeds what was allowed before.
TEST(Limit, StepsOfABodyAtRestAreWhole) {
  for (const double stiffer : {1.0, std::ldexp(1.0, 26)}) {
    for (const double away : {0.0, 0.1, 0.7, 3.0, 20.0}) {
      LiveInput input = clamped_block();
      for (Material& material : input.materials) material.youngs_modulus *= stiffer;
      for (Vec3& x : input.mesh.nodes) x += away * Vec3(1.0, -0.7, 0.3);
      const LiveBody body(input, {.law = LiveLaw::neo_hookean});
      LiveStepper stepper(body, options_of(Integrator::semi_implicit_euler, 0.95 * limit_of(body)));
      LiveState state(body);
      for (int k = 0; k < 50; ++k)
        ASSERT_TRUE(stepper.step(state).whole) << stiffer << " times E, " << away << " m, step " << k;
    }
  }
}

TEST(LiveSteps, AStepThatDoesNotGetThereIsHalved) {
  const LiveBody body(clamped_block(), {.law = LiveLaw::neo_hookean});
  StepperOptions options{.time_step = 0.05, .scheme = {.tolerance = 1e-9, .most_newton = 3}};
  LiveStepper stepper(body, options);
  LiveState state(body);
  state.x += pulled(body, 0.5);
  const LiveReport report = stepper.step(state);
  EXPECT_GT(report.parts, 1);
  EXPECT_EQ(stepper.counts().halved, 1);
  EXPECT_NEAR(state.time, 0.05, 1e-12);
  EXPECT_TRUE(state.x.allFinite());
}

TEST(LiveSteps, InvertedElementsAreSurvivedAndCounted) {
  for (const LiveLaw law : {LiveLaw::corotational, LiveLaw::corotational_qr, LiveLaw::neo_hookean}) {
    const LiveBody body(test::live_block(ElementType::tet4),
                        {.law = law, .damping = {.mass = 5.0, .stiffness = 1e-3}});
    LiveStepper stepper(body, {.time_step = 2e-3});
    LiveState state(body);
    state.x = test::shaken(body, 8e-3, 3);
    for (int k = 0; k < 400; ++k) stepper.step(state);
    EXPECT_GT(stepper.counts().inverted, 0) << name_of(law);
    EXPECT_GT(stepper.counts().most_inverted, 1) << name_of(law);
    EXPECT_TRUE(state.x.allFinite());
    EXPECT_LT(state.v.norm(), 0.1) << name_of(law);
  }
}

}  // namespace
}  // namespace palpate::live_steps_test
