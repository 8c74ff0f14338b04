// Steps of live bodies: against the linear integrators of the study, and what each keeps.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>

#include "base/error.h"
#include "runtime/live/live_stepper.h"
#include "statics/balance.h"
#include "tests/support/dynamics_bodies.h"
#include "tests/support/live_bodies.h"

namespace palpate::live_steps_test {
namespace {

using Eigen::VectorXd;

StepperOptions options_of(Integrator integrator, double h) {
  return {.time_step = h, .scheme = {.integrator = integrator, .tolerance = 1e-12, .most_newton = 60}};
}

test::Method method_of(Integrator integrator) {
  switch (integrator) {
    case Integrator::explicit_euler:
      return test::Method::explicit_euler;
    case Integrator::semi_implicit_euler:
      return test::Method::semi_implicit_euler;
    case Integrator::rk2:
      return test::Method::rk2;
    case Integrator::rk4:
      return test::Method::rk4;
    case Integrator::verlet:
      return test::Method::verlet;
    case Integrator::implicit_euler:
      return test::Method::implicit_euler;
    default:
      return test::Method::newmark;
  }
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
    for (const Integrator integrator : all_integrators) {
      const bool grows =
          !damped && (integrator == Integrator::explicit_euler || integrator == Integrator::rk2);
      // The study's Verlet has damping at the end of its step; the midpoint rule is not among them.
      if (grows || integrator == Integrator::midpoint || (damped && integrator == Integrator::verlet))
        continue;
      const double h = is_implicit(integrator) ? 5e-3 : 2e-4;
      LiveStepper stepper(body, options_of(integrator, h));
      LiveState state(body);
      const VectorXd u = pulled(body, 0.01), v = 3.0 * u;
      state.x += u;
      state.v = v;
      const std::vector<Eigen::Index> free(body.dof_of_free().begin(), body.dof_of_free().end());
      const auto reference = test::make_integrator(method_of(integrator), equation, u(free), v(free), h);
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
  throw_body(body, Mat3::Identity(), Vec3(1, 2, 0), Vec3(0.3, -0.2, 0.1), Vec3(4, 9, -7), state);
  return state;
}

TEST(LiveSteps, AFreeBodyKeepsItsMomenta) {
  for (const LiveLaw law : {LiveLaw::corotational, LiveLaw::neo_hookean, LiveLaw::mass_spring}) {
    const LiveBody body(test::live_block(ElementType::tet4), {.law = law});
    for (const Integrator integrator :
         {Integrator::semi_implicit_euler, Integrator::verlet, Integrator::midpoint,
          Integrator::implicit_euler, Integrator::newmark}) {
      LiveStepper stepper(body, options_of(integrator, is_implicit(integrator) ? 2e-3 : 2e-4));
      LiveState state = thrown(body);
      const Momenta before = momenta_of(body, state);
      for (int k = 0; k < 300; ++k) ASSERT_TRUE(stepper.step(state).whole);
      const Momenta after = momenta_of(body, state);
      EXPECT_LT((after.linear - before.linear).norm(), 1e-11 * before.linear.norm()) << name_of(integrator);
      if (integrator == Integrator::implicit_euler || integrator == Integrator::newmark) continue;
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
                        verlet = energy_range(Integrator::verlet, 4e-4),
                        rk4 = energy_range(Integrator::rk4, 4e-4),
                        implicit = energy_range(Integrator::implicit_euler, 4e-3),
                        midpoint = energy_range(Integrator::midpoint, 4e-3);
  EXPECT_GT(semi[0], 0.8);
  EXPECT_LT(semi[1], 1.2);
  EXPECT_GT(verlet[0], 0.97);
  EXPECT_LT(verlet[1], 1.03);
  EXPECT_GT(rk4[0], 0.97);
  EXPECT_LT(rk4[1], 1.0 + 1e-6);
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

// 2 / omega of semi-implicit Euler and Verlet, sqrt(8) / omega of RK4, 2 zeta / omega of explicit Euler.
TEST(Limit, IsThatOfTheHighestMode) {
  EXPECT_NEAR(longest_stable_step(Integrator::semi_implicit_euler, 10.0, 0.0), 0.2, 1e-6);
  EXPECT_NEAR(longest_stable_step(Integrator::verlet, 10.0, 0.0), 0.2, 1e-6);
  EXPECT_NEAR(longest_stable_step(Integrator::rk4, 1.0, 0.0), std::sqrt(8.0), 1e-6);
  EXPECT_NEAR(longest_stable_step(Integrator::explicit_euler, 1.0, 0.1), 0.2, 1e-6);
  EXPECT_EQ(longest_stable_step(Integrator::explicit_euler, 1.0, 0.0), 0.0);
  EXPECT_NEAR(longest_stable_step(Integrator::explicit_euler, 2.0, 1e-4), 1e-4, 1e-15);
  EXPECT_NEAR(longest_stable_step(Integrator::explicit_euler, 1.0, 1.25), 1.0, 1e-12);  // roots 0.5 and 2
  EXPECT_NEAR(longest_stable_step(Integrator::semi_implicit_euler, 1.0, 0.3), 2.0 * (std::sqrt(1.09) - 0.3),
              1e-6);
  EXPECT_TRUE(std::isinf(longest_stable_step(Integrator::newmark, 1.0, 0.0)));

  const LiveInput input = clamped_block();
  test::ElasticCase block(input.mesh, input.materials[0]);
  block.hold([](const Vec3& x) { return x.x() < 1e-9; }, 7);
  const double omega = test::all_modes(test::equation_of(block, true)).omega.maxCoeff();
  const LiveBody body(input, {.law = LiveLaw::corotational});
  LargestFrequency frequency(body);
  EXPECT_NEAR(frequency.estimate(body.rest(), {}, 300) / omega, 1.0, 1e-3);
}

TEST(Limit, StepsBeyondItAreRefusedAndDiverge) {
  const LiveBody body(clamped_block(), {.law = LiveLaw::linear});
  for (const Integrator integrator : {Integrator::semi_implicit_euler, Integrator::verlet, Integrator::rk4}) {
    const double limit = LiveStepper(body, options_of(integrator, 1e-6)).limit_at_rest();
    EXPECT_THROW(LiveStepper(body, options_of(integrator, 1.001 * limit)), Error);
    LiveStepper stepper(body, options_of(integrator, 0.99 * limit));
    LiveState state(body);
    state.x += pulled(body, 0.01);
    const double before = momenta_of(body, state).energy();
    for (int k = 0; k < 1000; ++k) {
      const LiveReport report = stepper.step(state);
      ASSERT_TRUE(report.whole && report.parts == 1 && report.is_near);
    }
    EXPECT_LT(momenta_of(body, state).energy(), 100.0 * before);
    // Not refused, it would grow.
    const auto accelerate = [&](const VectorXd& x, const VectorXd&) {
      VectorXd f;
      internal_forces(body, x, {}, f);
      for (Eigen::Index dof = 0; dof < f.size(); ++dof)
        f[dof] *= body.free_of_dof()[static_cast<std::size_t>(dof)] < 0 ? 0.0 : 1.0 / body.mass()[dof];
      return f;
    };
    LiveState wild(body);
    wild.x += pulled(body, 0.01);
    for (int k = 0; k < 1000; ++k) step_explicitly(integrator, 1.02 * limit, accelerate, wild.x, wild.v);
    EXPECT_GT(momenta_of(body, wild).energy(), 1e6 * before) << name_of(integrator);
  }
  EXPECT_THROW(LiveStepper(body, options_of(Integrator::rk2, 1e-9)), Error);
  EXPECT_THROW(LiveStepper(body, options_of(Integrator::newmark, 0.0)), Error);
}

// A pressed neo-Hookean body becomes stiffer than it was at rest: steps that were stable are cut and counted.
TEST(Limit, IsWatchedWhileTheBodyStiffens) {
  const LiveBody body(clamped_block(), {.law = LiveLaw::neo_hookean, .damping = {.mass = 20.0}});
  const double limit = LiveStepper(body, options_of(Integrator::verlet, 1e-6)).limit_at_rest();
  LiveStepper stepper(body, options_of(Integrator::verlet, 0.95 * limit));
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
  EXPECT_GT(stepper.counts().near_limit, 100);
  EXPECT_TRUE(state.x.allFinite());
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
  for (const LiveLaw law :
       {LiveLaw::corotational, LiveLaw::corotational_qr, LiveLaw::neo_hookean, LiveLaw::mass_spring}) {
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
