// Time integrators on the oscillator u'' + 2 zeta omega u' + omega^2 u = f, against its closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include "tests/integrators/stability_limit.h"
#include "tests/support/bodies/dynamics_bodies.h"

namespace palpate::oscillator_test {
namespace {

using test::Integrator;
using test::Method;
using test::NewmarkIntegrator;
using test::oscillator;
using test::scalar;

constexpr double pi = std::numbers::pi;

/// The motion of an underdamped oscillator that is let go at u0 with v0 under a constant force.
struct Motion {
  double omega, zeta, force, u0, v0;

  [[nodiscard]] double u(double t) const {
    const double rest = force / (omega * omega), damped = omega * std::sqrt(1.0 - zeta * zeta);
    const double A = u0 - rest, B = (v0 + zeta * omega * A) / damped;
    return rest + std::exp(-zeta * omega * t) * (A * std::cos(damped * t) + B * std::sin(damped * t));
  }
};

/// Largest |u - closed form| until `end` [m].
double largest_error(Integrator& integrator, const Motion& motion, double end) {
  double largest = 0.0;
  while (integrator.time() < end) {
    integrator.step();
    largest = std::max(largest, std::abs(integrator.u()[0] - motion.u(integrator.time())));
  }
  return largest;
}

// Without damping the phase of the period is late by 2 pi (omega Dt)^2 / 12, and that times the amplitude (1
// here) is the error; with damping the amplitude is smaller when it counts.
TEST(Oscillator, NewmarkFollowsTheClosedForm) {
  const double omega = 2.0 * pi, Dt = 1e-3, late = 2.0 * pi * std::pow(omega * Dt, 2) / 12.0;
  for (const Motion& motion : {Motion{omega, 0.0, 0.0, 1.0, 0.0}, Motion{omega, 0.0, 0.0, 0.0, omega},
                               Motion{omega, 0.0, omega * omega, 0.0, 0.0}, Motion{omega, 0.1, 0.0, 1.0, 0.0},
                               Motion{omega, 0.3, 2.0 * omega * omega, 1.0, 0.0}}) {
    NewmarkIntegrator newmark(oscillator(omega, motion.zeta, [&](double) { return motion.force; }),
                              Newmark{.time_step = Dt}, scalar(motion.u0), scalar(motion.v0));
    const double error = largest_error(newmark, motion, 1.0);
    EXPECT_LT(error, 1.001 * late) << "zeta " << motion.zeta << " force " << motion.force;
    if (motion.zeta == 0.0) {
      EXPECT_GT(error, 0.7 * late);
    }
  }
}

/// Error of u and v / omega at t = 1 [m], under a force that makes u = cos(W t) + a free motion.
double error_at_end(Method method, int steps) {
  const double omega = 7.0, zeta = 0.1, W = 4.0;
  const double damped = omega * std::sqrt(1.0 - zeta * zeta), decay = zeta * omega;
  const auto force = [&](double t) {
    return (omega * omega - W * W) * std::cos(W * t) - 2.0 * zeta * omega * W * std::sin(W * t);
  };
  const std::unique_ptr<Integrator> integrator =
      make_integrator(method, oscillator(omega, zeta, force), scalar(2.0), scalar(-decay), 1.0 / steps);
  for (int k = 0; k < steps; ++k) integrator->step();
  const double free = std::exp(-decay), u = std::cos(W) + free * std::cos(damped);
  const double v = -W * std::sin(W) - free * (decay * std::cos(damped) + damped * std::sin(damped));
  return std::hypot(integrator->u()[0] - u, (integrator->v()[0] - v) / omega);
}

TEST(Oscillator, OrderOfConvergence) {
  const std::map<Method, int> orders = {
      {Method::explicit_euler, 1}, {Method::semi_implicit_euler, 1}, {Method::rk2, 2},    {Method::rk4, 4},
      {Method::verlet, 2},         {Method::implicit_euler, 1},      {Method::newmark, 2}};
  for (const Method method : test::all_methods) {
    const int steps = orders.at(method) == 1 ? 20000 : 200;  // where the next term of the error is small
    const double order = std::log2(error_at_end(method, steps) / error_at_end(method, 2 * steps));
    EXPECT_NEAR(order, orders.at(method), 0.03) << name_of(method);
  }
}

/// Angular frequency of sampled oscillations [rad/s], fitted: u(t + Dt) + u(t - Dt) = 2 cos(omega Dt) u(t).
double measured_frequency(const std::vector<double>& u, double Dt) {
  double products = 0.0, squares = 0.0;
  for (std::size_t k = 1; k + 1 < u.size(); ++k) {
    products += u[k] * (u[k + 1] + u[k - 1]);
    squares += u[k] * u[k];
  }
  return std::acos(0.5 * products / squares) / Dt;
}

TEST(Oscillator, NewmarksPeriodIsLongByATwelfthOfTheSquareOfOmegaDt) {
  const double omega = 10.0;
  for (const double omega_Dt : {0.4, 0.2, 0.1, 0.05}) {
    const double Dt = omega_Dt / omega, leading = omega_Dt * omega_Dt / 12.0;
    NewmarkIntegrator newmark(oscillator(omega), Newmark{.time_step = Dt}, scalar(1.0), scalar(0.0));
    std::vector<double> u{1.0};
    for (int k = 0; k < 2000; ++k) {
      newmark.step();
      u.push_back(newmark.u()[0]);
    }
    const double longer = omega / measured_frequency(u, Dt) - 1.0;
    EXPECT_NEAR(longer / leading, 1.0, 0.2 * omega_Dt * omega_Dt) << omega_Dt;  // next term: -3/20 its square
  }
}

// The product of the two amplification factors, |lambda|^2 of an oscillation, is what delta - 1/2 changes:
// 1 - (delta - 1/2) h^2 / (1 + alpha h^2), h = omega Dt (Hughes 1987, section 9.3). Below 1/2 every
// oscillation grows, however short the step: such files are refused.
TEST(Oscillator, DeltaOverOneHalfDissipatesAndUnderItGrows) {
  for (const double delta : {0.4, 0.49, 0.5, 0.51, 0.6}) {
    const double alpha = 0.25 * std::pow(std::max(delta, 0.5) + 0.5, 2);
    for (const double h : {0.1, 0.5, 2.0}) {
      const Newmark newmark{.alpha = alpha, .delta = delta, .time_step = h};
      const Eigen::Matrix2d A = test::amplification([&](const auto& u, const auto& v) {
        return std::make_unique<NewmarkIntegrator>(oscillator(1.0), newmark, u, v);
      });
      EXPECT_NEAR(A.determinant(), 1.0 - (delta - 0.5) * h * h / (1.0 + alpha * h * h), 1e-14);

      NewmarkIntegrator swing(oscillator(1.0), newmark, scalar(1.0), scalar(0.0));
      const double before = swing.energy();
      for (int k = 0; k < 4000; ++k) swing.step();
      const double ratio = swing.energy() / before;
      EXPECT_TRUE(delta > 0.5   ? ratio < 0.9
                  : delta < 0.5 ? ratio > 1.1
                                : std::abs(ratio - 1.0) < 1e-10)
          << "delta " << delta << " h " << h << ": " << ratio;
    }
  }
}

}  // namespace
}  // namespace palpate::oscillator_test
