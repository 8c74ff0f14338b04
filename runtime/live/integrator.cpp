#include "runtime/live/integrator.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

namespace palpate {
namespace {

/// True if no motion of an oscillator with omega = 1 grows in steps of h.
bool is_stable(Integrator integrator, double h, double zeta) {
  Eigen::Matrix2d A;
  const auto accelerate = [zeta](double x, double v) { return -x - 2.0 * zeta * v; };
  for (int k = 0; k < 2; ++k) {
    double x = 1 - k, v = k;
    step_explicitly(integrator, h, accelerate, x, v);
    A.col(k) << x, v;
  }
  return A.eigenvalues().cwiseAbs().maxCoeff() < 1.0 + 1e-9;
}

}  // namespace

const char* name_of(Integrator integrator) noexcept {
  constexpr std::array<const char*, 8> names = {
      "explicit-euler", "semi-implicit-euler", "rk2",      "rk4",
      "verlet",         "implicit-euler",      "midpoint", "newmark"};
  return names[static_cast<std::size_t>(integrator)];
}

double longest_stable_step(Integrator integrator, double omega, double zeta) {
  if (is_implicit(integrator) || !(omega > 0.0)) return std::numeric_limits<double>::infinity();
  // |1 - zeta h +- i sqrt(1 - zeta^2) h| <= 1; of real roots the larger one.
  if (integrator == Integrator::explicit_euler)
    return 2.0 / omega * (zeta <= 1.0 ? zeta : 1.0 / (zeta + std::sqrt(zeta * zeta - 1.0)));
  // Finds the first unstable step among growing ones, then bisects between it and the last stable one.
  double stable = 0.0, unstable = 0.01;
  while (unstable < 10.0 && is_stable(integrator, unstable, zeta)) {
    stable = unstable;
    unstable *= 1.02;
  }
  if (stable == 0.0) return 0.0;
  for (int k = 0; k < 40; ++k) {
    const double middle = 0.5 * (stable + unstable);
    (is_stable(integrator, middle, zeta) ? stable : unstable) = middle;
  }
  return stable / omega;
}

}  // namespace palpate
