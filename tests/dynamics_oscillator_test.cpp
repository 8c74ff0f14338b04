// Every time integrator on the oscillator u'' + 2 zeta omega u' + omega^2 u = f, against its closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/dynamics_bodies.h"

namespace palpate {
namespace {

using test::Equation;
using test::Integrator;
using test::Method;
using test::oscillator;
using test::scalar;

constexpr double pi = std::numbers::pi;

/// The motion of the underdamped oscillator from u0, v0 under a constant force.
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

// The first terms of the error: in an undamped period its phase is late by 2 pi (omega Dt)^2 / 12.
TEST(Oscillator, NewmarkFollowsTheClosedForm) {
  const double omega = 2.0 * pi, Dt = 1e-3, late = 2.0 * pi * std::pow(omega * Dt, 2) / 12.0;
  for (const Motion& motion : {Motion{omega, 0.0, 0.0, 1.0, 0.0}, Motion{omega, 0.0, 0.0, 0.0, omega},
                               Motion{omega, 0.1, 0.0, 1.0, 2.0}, Motion{omega, 0.0, omega * omega, 0.0, 0.0},
                               Motion{omega, 0.3, 2.0 * omega * omega, 1.0, -3.0}}) {
    test::NewmarkIntegrator newmark(oscillator(omega, motion.zeta, motion.force), Newmark{.time_step = Dt},
                                    scalar(motion.u0), scalar(motion.v0));
    EXPECT_LT(largest_error(newmark, motion, 1.0), 1.01 * late) << "zeta " << motion.zeta;
  }
}

}  // namespace
}  // namespace palpate
