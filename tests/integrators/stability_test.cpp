// The longest time step with which each integrator is stable, on the oscillator and on a body.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <map>

#include "tests/integrators/stability_limit.h"
#include "tests/support/bodies/dynamics_bodies.h"

namespace palpate::stability_test {
namespace {

using test::Integrator;
using test::Method;
using test::oscillator;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// In omega Dt.
template <class Stable>
double limit_of(Stable stable) {
  return test::stability_limit(stable, 0.05, 1e4);
}

double measured_limit(Method method, double zeta) {
  return limit_of([&](double h) {
    return test::is_stable([&](const auto& u, const auto& v) {
      return make_integrator(method, oscillator(1.0, zeta), u, v, h);
    });
  });
}

/// Where |1 + z + ... + z^order / order!| leaves 1 along z = h (-zeta + i sqrt(1 - zeta^2)): a Runge-Kutta
/// method of as many stages as its order.
double runge_kutta_limit(int order, double zeta) {
  return limit_of([&](double h) {
    const std::complex<double> z = h * std::complex<double>(-zeta, std::sqrt(1.0 - zeta * zeta));
    std::complex<double> R = 1.0, term = 1.0;
    for (int k = 1; k <= order; ++k) R += term *= z / static_cast<double>(k);
    return std::abs(R) < 1.0 + 1e-8;
  });
}

TEST(Stability, LimitsWithoutDamping) {
  const std::map<Method, double> limits = {{Method::explicit_euler, 0.0},
                                           {Method::semi_implicit_euler, 2.0},
                                           {Method::rk2, 0.0},
                                           {Method::rk4, 2.0 * std::sqrt(2.0)},
                                           {Method::verlet, 2.0},
                                           {Method::implicit_euler, infinity},
                                           {Method::newmark, infinity}};
  for (const Method method : test::all_methods) {
    const double limit = measured_limit(method, 0.0);
    if (std::isinf(limits.at(method))) {
      EXPECT_EQ(limit, infinity) << name_of(method);
    } else {
      EXPECT_NEAR(limit, limits.at(method), 1e-6) << name_of(method);
    }
  }
}

// Explicit Euler: |1 + s Dt|^2 = 1 - 2 zeta h + h^2. Semi-implicit Euler: -1 is a root of
// x^2 - (2 - 2 zeta h - h^2) x + 1 - 2 zeta h. Verlet's damping is implicit and leaves its limit.
TEST(Stability, LimitsWithDamping) {
  for (const double zeta : {0.1, 0.3, 0.8}) {
    EXPECT_NEAR(measured_limit(Method::explicit_euler, zeta), 2.0 * zeta, 1e-6);
    EXPECT_NEAR(measured_limit(Method::semi_implicit_euler, zeta),
                2.0 * (std::sqrt(1.0 + zeta * zeta) - zeta), 1e-6);
    EXPECT_NEAR(measured_limit(Method::verlet, zeta), 2.0, 1e-6);
    EXPECT_NEAR(measured_limit(Method::rk2, zeta), runge_kutta_limit(2, zeta), 1e-6);
    EXPECT_NEAR(measured_limit(Method::rk4, zeta), runge_kutta_limit(4, zeta), 1e-6);
    EXPECT_EQ(measured_limit(Method::implicit_euler, zeta), infinity);
    EXPECT_EQ(measured_limit(Method::newmark, zeta), infinity);
  }
}

// With alpha below (delta + 1/2)^2 / 4 Newmark too has a limit: 1 / sqrt(delta / 2 - alpha) at delta = 1/2.
TEST(Stability, NewmarkBelowItsLeastAlpha) {
  for (const double alpha : {1.0 / 6.0, 1.0 / 12.0, 0.2}) {
    const double limit = limit_of([&](double h) {
      return test::is_stable([&](const auto& u, const auto& v) {
        return std::make_unique<test::NewmarkIntegrator>(
            oscillator(1.0), Newmark{.alpha = alpha, .delta = 0.5, .time_step = h}, u, v);
      });
    });
    EXPECT_NEAR(limit, 1.0 / std::sqrt(0.25 - alpha), 1e-6);
  }
}

/// The largest energy in 500 steps of omega_Dt / omega_max, of that at the beginning.
double growth(Method method, const test::Equation& equation, double omega_max, double omega_Dt) {
  const Eigen::Index n = equation.M.rows();
  const std::unique_ptr<Integrator> integrator =
      make_integrator(method, equation, Eigen::VectorXd::LinSpaced(n, -1e-3, 2e-3), Eigen::VectorXd::Zero(n),
                      omega_Dt / omega_max);
  const double before = integrator->energy();
  double largest = before;
  for (int k = 0; k < 500; ++k) {
    integrator->step();
    largest = std::max(largest, integrator->energy());
  }
  return largest / before;
}

TEST(Stability, TheHighestModeOfABodySetsItsLimit) {
  for (const bool lumped : {false, true}) {
    const test::Equation equation = equation_of(test::clamped_block({4, 2, 2}), lumped);
    const Eigen::VectorXd omega = all_modes(equation).omega;
    const double omega_max = omega[omega.size() - 1];
    for (const Method method : {Method::semi_implicit_euler, Method::verlet, Method::rk4}) {
      const double limit = method == Method::rk4 ? std::sqrt(8.0) : 2.0;
      EXPECT_LT(growth(method, equation, omega_max, 0.99 * limit), 100.0) << name_of(method);
      EXPECT_GT(growth(method, equation, omega_max, 1.01 * limit), 1e6) << name_of(method);
    }
    for (const Method method : {Method::implicit_euler, Method::newmark})
      EXPECT_LT(growth(method, equation, omega_max, 100.0), 1.0 + 1e-10) << name_of(method);
    for (const Method method : {Method::explicit_euler, Method::rk2})
      EXPECT_GT(growth(method, equation, omega_max, 1.0), 1e6) << name_of(method);
  }
}

}  // namespace
}  // namespace palpate::stability_test
