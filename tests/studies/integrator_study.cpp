// Newmark among other time integrators, on one body of about 1000 dofs.
//
//   integrator_study FOLDER
//
// Prints a table of the longest stable time steps and what a step costs. Writes to FOLDER energy.csv (energy
// over time, of that at release, for two time steps) and limits.csv. scripts/studies/integrators runs it.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <vector>

#include "tests/integrators/stability_limit.h"
#include "tests/support/bodies/dynamics_bodies.h"

namespace palpate::test {
namespace {

using Eigen::VectorXd;

constexpr double tick = 1e-3;                                       // [s]
constexpr std::array<double, 2> energy_steps = {tick, 2.0 * tick};  // for which energy is drawn
constexpr double swing_time = 1.0;                                  // [s]
constexpr double zeta = 0.05;                                       // of the first and the tenth mode

/// The body with consistent or lumped M, and what its modes say.
struct Body {
  Equation equation;
  VectorXd omega;    ///< [n] of all modes [rad/s]
  Rayleigh damping;  ///< for the columns with damping
  VectorXd pulled;   ///< [n] by a force across on the far end: where it is let go [m]
};

Body make_body(bool lumped) {
  const ElasticCase block = clamped_block({8, 6, 5});
  Body body{.equation = equation_of(block, lumped), .omega = {}, .damping = {}, .pulled = {}};
  body.omega = all_modes(body.equation).omega;
  body.damping = rayleigh_damping(body.omega[0], zeta, body.omega[9], zeta);
  const Stiffness stiffness = assemble_stiffness(block.body());
  VectorXd force = VectorXd::Zero(body.omega.size());
  for (std::size_t node = 0; node < block.mesh.nodes.size(); ++node) {
    if (block.mesh.nodes[node].x() > 0.1 - 1e-9) force[stiffness.free_of_dof[3 * node + 2]] = -1e-3;
  }
  body.pulled = SparseSolver(body.equation.K).solve(force);
  return body;
}

/// Longest stable time step [s]: that of the oscillator that each mode is (Rayleigh's damping keeps them
/// apart).
double longest_step(const Body& body, Method method, const Rayleigh& damping) {
  const VectorXd highest_first = body.omega.reverse();  // which says no soonest
  const auto stable = [&](double Dt) {
    return std::all_of(highest_first.begin(), highest_first.end(), [&](double omega) {
      const double ratio = 0.5 * (damping.mass / omega + damping.stiffness * omega);
      return is_stable([&](const auto& u, const auto& v) {
        return make_integrator(method, oscillator(omega, ratio), u, v, Dt);
      });
    });
  };
  const double omega_max = body.omega.maxCoeff();
  return stability_limit(stable, 0.02 / omega_max, 1e4 / omega_max);
}

/// Median time of a step [s], in steps short enough for all.
double step_cost(const Body& body, Method method) {
  const auto integrator = make_integrator(method, body.equation, body.pulled,
                                          VectorXd::Zero(body.pulled.size()), 0.1 / body.omega.maxCoeff());
  std::vector<double> seconds;
  for (int k = 0; k < 400; ++k) {
    const auto begin = std::chrono::steady_clock::now();
    integrator->step();
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  }
  std::nth_element(seconds.begin(), seconds.begin() + 200, seconds.end());
  return seconds[200];
}

/// Writes energy over time, of that at release, until it is a thousandfold. Returns the last.
double write_energy(const Body& body, Method method, double Dt, std::ofstream& out) {
  const auto integrator =
      make_integrator(method, body.equation, body.pulled, VectorXd::Zero(body.pulled.size()), Dt);
  const double before = integrator->energy();
  for (double share = 1.0;; share = integrator->energy() / before) {
    out << fmt::format("{},{},{:.6f},{:.9g}\n", name_of(method), Dt, integrator->time(), share);
    if (integrator->time() > swing_time || !(share < 1e3)) return share;
    integrator->step();
  }
}

std::string in_milliseconds(double seconds) {
  if (seconds == 0.0) return "none";
  return std::isinf(seconds) ? "any" : fmt::format("{:.3g}", 1e3 * seconds);
}

void study(const std::string& folder) {
  const Body consistent = make_body(false), lumped = make_body(true);
  std::ofstream energy(folder + "/energy.csv"), limits(folder + "/limits.csv");
  energy << "integrator,Dt,t,share\n";
  limits << "integrator,limit,damped,cost,lumped_limit,lumped_damped,lumped_cost\n";
  fmt::print("{} dofs, ω from {:.1f} to {:.0f} rad/s (lumped: {:.0f})\n\n", consistent.omega.size(),
             consistent.omega.minCoeff(), consistent.omega.maxCoeff(), lumped.omega.maxCoeff());
  fmt::print(
      "| integrator | longest Δt [ms] | damped | µs a step | s a second | lumped M: longest Δt [ms] | damped "
      "| "
      "µs a step | s a second | energy after 1 s, Δt = 1 ms | 2 ms "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const Method method : all_methods) {
    std::string row = "| " + name_of(method) + " |", line = name_of(method);
    for (const Body* body : {&consistent, &lumped}) {
      const double limit = longest_step(*body, method, {}),
                   damped = longest_step(*body, method, body->damping);
      const double cost = step_cost(*body, method), Dt = std::min(limit, tick);
      row += fmt::format(" {} | {} | {:.0f} | {} |", in_milliseconds(limit), in_milliseconds(damped),
                         1e6 * cost, Dt > 0.0 ? fmt::format("{:.2f}", cost / Dt) : "–");
      line += fmt::format(",{},{},{}", limit, damped, cost);
    }
    for (const double Dt : energy_steps) {
      const double share = write_energy(consistent, method, Dt, energy);
      row += share < 1e3 ? fmt::format(" {:.1f} % |", 100.0 * share) : " without bound |";
    }
    fmt::print("{}\n", row);
    limits << line << '\n';
  }
}

}  // namespace
}  // namespace palpate::test

int main(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr, "usage: integrator_study FOLDER\n");
    return 2;
  }
  palpate::test::study(argv[1]);
}
