// Time integrators on an elastic body, against its modes.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <map>
#include <vector>

#include "tests/support/bodies/dynamics_bodies.h"

namespace palpate::body_test {
namespace {

using Eigen::VectorXd;
using test::clamped_block;
using test::Equation;
using test::Integrator;
using test::Method;
using test::Modes;
using test::NewmarkIntegrator;

/// A damped block under a force that changes.
Equation pushed_block(bool lumped) {
  Equation equation = equation_of(clamped_block({3, 2, 2}), lumped, {.mass = 0.8, .stiffness = 2e-3});
  equation.f = [n = equation.M.rows()](double time) -> VectorXd {
    return std::sin(30.0 * time) * VectorXd::LinSpaced(n, -1e-3, 3e-3);
  };
  return equation;
}

/// |M a + C v + K u - f| at the end of a step, of |M a|.
double imbalance(const Integrator& at, const Equation& equation) {
  const VectorXd inertia = equation.M.selfadjointView<Eigen::Lower>() * at.a();
  return (inertia - equation.force_left(at.time(), at.u(), at.v())).norm() / inertia.norm();
}

TEST(SwingingBody, EveryStepEndsInBalance) {
  for (const bool lumped : {false, true}) {
    const Equation equation = pushed_block(lumped);
    const Eigen::Index n = equation.M.rows();
    for (const Method method : test::all_methods) {
      const std::unique_ptr<Integrator> integrator =
          make_integrator(method, equation, VectorXd::LinSpaced(n, 1e-3, 0.0), VectorXd::Zero(n), 1e-4);
      EXPECT_LT(imbalance(*integrator, equation), 1e-10) << name_of(method) << " at release";
      for (int k = 0; k < 20; ++k) {
        integrator->step();
        EXPECT_LT(imbalance(*integrator, equation), 1e-9) << name_of(method);
      }
    }
  }
}

// What the implicit ones solve for, besides the balance: u' and v' as each of them defines these.
TEST(SwingingBody, ImplicitStepsAreWhatDefinesThem) {
  const Equation equation = pushed_block(false);
  const Eigen::Index n = equation.M.rows();
  const VectorXd u0 = VectorXd::LinSpaced(n, 1e-3, 0.0), v0 = VectorXd::LinSpaced(n, 0.0, 0.01);
  const double Dt = 5e-3;
  for (const Newmark& newmark : {Newmark{.alpha = 0.25, .delta = 0.5, .time_step = Dt},
                                 Newmark{.alpha = 0.3025, .delta = 0.6, .time_step = Dt},
                                 Newmark{.alpha = 0.5, .delta = 0.75, .time_step = Dt}}) {
    NewmarkIntegrator swing(equation, newmark, u0, v0);
    for (int k = 0; k < 10; ++k) {
      const VectorXd u = swing.u(), v = swing.v(), a = swing.a();
      swing.step();
      const VectorXd u_after = u + Dt * v + Dt * Dt * ((0.5 - newmark.alpha) * a + newmark.alpha * swing.a());
      const VectorXd v_after = v + Dt * ((1.0 - newmark.delta) * a + newmark.delta * swing.a());
      EXPECT_LT((swing.u() - u_after).norm(), 1e-12 * u.norm());
      EXPECT_LT((swing.v() - v_after).norm(), 1e-12 * v.norm());
      EXPECT_LT(imbalance(swing, equation), 1e-9);
    }
  }
  const auto euler = make_integrator(Method::implicit_euler, equation, u0, v0, Dt);
  for (int k = 0; k < 10; ++k) {
    const VectorXd u = euler->u(), v = euler->v();
    euler->step();
    EXPECT_LT((euler->u() - u - Dt * euler->v()).norm(), 1e-12 * u.norm());
    EXPECT_LT((euler->v() - v - Dt * euler->a()).norm(), 1e-12 * v.norm());
    EXPECT_LT(imbalance(*euler, equation), 1e-9);
  }
}

// C = 0, f = 0: Newmark's with alpha = 1/4, delta = 1/2 is the trapezoidal rule, which keeps the energy.
TEST(SwingingBody, NewmarkKeepsTheEnergy) {
  for (const bool lumped : {false, true}) {
    const Equation equation = equation_of(clamped_block({4, 3, 2}), lumped);
    const Eigen::Index n = equation.M.rows();
    for (const double Dt : {1e-3, 1e-2}) {
      NewmarkIntegrator newmark(equation, Newmark{.time_step = Dt}, VectorXd::LinSpaced(n, -1e-3, 2e-3),
                                VectorXd::LinSpaced(n, 0.02, -0.01));
      const double before = newmark.energy();
      double drift = 0.0;
      for (int k = 0; k < 10000; ++k) {
        newmark.step();
        drift = std::max(drift, std::abs(newmark.energy() / before - 1.0));
      }
      EXPECT_LT(drift, 1e-10) << (lumped ? "lumped" : "consistent") << ", Dt " << Dt;
    }
  }
}

/// Decay rate of a sampled oscillation [1/s], fitted: q(t + Dt) = c q(t) - exp(-2 rate Dt) q(t - Dt).
double measured_decay(const std::vector<double>& q, double Dt) {
  Eigen::MatrixX2d before(static_cast<Eigen::Index>(q.size()) - 2, 2);
  VectorXd after(before.rows());
  for (Eigen::Index k = 0; k < before.rows(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    before.row(k) << q[i + 1], q[i];
    after[k] = q[i + 2];
  }
  const Eigen::Vector2d c = before.colPivHouseholderQr().solve(after);
  return -0.5 * std::log(-c[1]) / Dt;
}

// Newmark's steps change the rate by about (omega Dt)^2 / 4 of it.
TEST(SwingingBody, RayleighDampingDecaysAsPredicted) {
  const Equation free = equation_of(clamped_block({4, 2, 2}));
  const Modes modes = all_modes(free);
  const Eigen::Index low = 0, high = 7, between = 3;
  const Rayleigh damping = rayleigh_damping(modes.omega[low], 0.03, modes.omega[high], 0.08);
  const Equation equation = equation_of(clamped_block({4, 2, 2}), false, damping);
  const double omega_between = modes.omega[between];
  const std::map<Eigen::Index, double> ratios = {
      {low, 0.03},
      {high, 0.08},
      {between, 0.5 * (damping.mass / omega_between + damping.stiffness * omega_between)}};
  for (const auto& [mode, zeta] : ratios) {
    const double omega = modes.omega[mode], Dt = 0.02 / omega;
    const VectorXd shape = modes.shapes.col(mode), to_mode = free.M.selfadjointView<Eigen::Lower>() * shape;
    NewmarkIntegrator newmark(equation, Newmark{.time_step = Dt}, 1e-3 * shape, VectorXd::Zero(shape.size()));
    std::vector<double> q{1e-3};
    for (int k = 0; k < 2000; ++k) {
      newmark.step();
      q.push_back(to_mode.dot(newmark.u()));
    }
    EXPECT_NEAR(measured_decay(q, Dt) / (zeta * omega), 1.0, 3e-4) << "mode " << mode;
  }
}

/// Error of u at the time `end`, of its size, against the sum of all modes, each by its closed form.
double error_at_end(Method method, const Equation& equation, const Rayleigh& damping, const Modes& modes,
                    double end, int steps) {
  const auto M = equation.M.selfadjointView<Eigen::Lower>();
  // The lowest modes only: with the highest the order would show in unbearably short steps.
  const VectorXd u0 = modes.shapes.leftCols(5) * VectorXd::LinSpaced(5, 1e-3, 0.5e-3);
  VectorXd q = modes.shapes.transpose() * (M * u0);
  for (Eigen::Index k = 0; k < q.size(); ++k) {
    const double omega = modes.omega[k], decay = 0.5 * (damping.mass + damping.stiffness * omega * omega);
    if (decay >= omega) continue;  // of which u0 has nothing
    const double damped = std::sqrt(omega * omega - decay * decay);
    q[k] *= std::exp(-decay * end) * (std::cos(damped * end) + decay / damped * std::sin(damped * end));
  }
  const VectorXd exact = modes.shapes * q;
  const std::unique_ptr<Integrator> integrator =
      make_integrator(method, equation, u0, VectorXd::Zero(u0.size()), end / steps);
  for (int k = 0; k < steps; ++k) integrator->step();
  return (integrator->u() - exact).norm() / exact.norm();
}

TEST(SwingingBody, EveryIntegratorConvergesToTheSumOfModes) {
  const std::map<Method, double> orders = {
      {Method::explicit_euler, 1}, {Method::semi_implicit_euler, 1}, {Method::rk2, 2},    {Method::rk4, 4},
      {Method::verlet, 2},         {Method::implicit_euler, 1},      {Method::newmark, 2}};
  for (const bool lumped : {false, true}) {
    const Modes modes = all_modes(equation_of(clamped_block({2, 1, 1}), lumped));
    const Rayleigh damping = rayleigh_damping(modes.omega[0], 0.05, modes.omega[4], 0.05);
    const Equation equation = equation_of(clamped_block({2, 1, 1}), lumped, damping);
    const double end = 4.0 / modes.omega[0];
    for (const Method method : test::all_methods) {
      const int steps = orders.at(method) == 1 ? 8000 : 400;
      const double coarse = error_at_end(method, equation, damping, modes, end, steps);
      const double fine = error_at_end(method, equation, damping, modes, end, 2 * steps);
      EXPECT_LT(fine, 0.01) << name_of(method);
      EXPECT_NEAR(std::log2(coarse / fine), orders.at(method), 0.1) << name_of(method);
    }
  }
}

}  // namespace
}  // namespace palpate::body_test
