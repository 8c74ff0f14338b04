// Time integrators of live bodies: those compared by Sito (2019, section 3.3), Newmark's, and the midpoint
// rule.
#pragma once

#include <array>
#include <cstdint>

namespace palpate {

enum class Integrator : std::uint8_t {
  explicit_euler,
  semi_implicit_euler,  ///< also called symplectic Euler
  rk2,                  ///< the explicit midpoint rule
  rk4,
  verlet,          ///< velocity Verlet; damping at the mid-step velocity
  implicit_euler,  ///< damps motion faster than its step
  midpoint,        ///< implicit; conserves momentum and angular momentum
  newmark,         ///< alpha = 1/4, delta = 1/2 (theory.md section 5)
};

inline constexpr std::array<Integrator, 8> all_integrators = {
    Integrator::explicit_euler, Integrator::semi_implicit_euler, Integrator::rk2,      Integrator::rk4,
    Integrator::verlet,         Integrator::implicit_euler,      Integrator::midpoint, Integrator::newmark};

/// Returns the name as users give it: explicit-euler, semi-implicit-euler, rk2, rk4, verlet, implicit-euler,
/// midpoint, newmark.
const char* name_of(Integrator integrator) noexcept;

constexpr bool is_implicit(Integrator integrator) noexcept {
  return integrator >= Integrator::implicit_euler;
}

/// Performs one step h [s] of x'' = a(x, x') by an explicit integrator, in place. Any type of vector or
/// number; accelerate(x, v) returns the same type.
template <class Vector, class Accelerate>
void step_explicitly(Integrator integrator, double h, const Accelerate& accelerate, Vector& x, Vector& v) {
  switch (integrator) {
    case Integrator::explicit_euler: {
      const Vector a = accelerate(x, v);
      x += h * v;
      v += h * a;
      return;
    }
    case Integrator::rk2: {
      const Vector a = accelerate(x, v), v_half = v + 0.5 * h * a, x_half = x + 0.5 * h * v;
      x += h * v_half;
      v += h * accelerate(x_half, v_half);
      return;
    }
    case Integrator::rk4: {
      const Vector a1 = accelerate(x, v), v2 = v + 0.5 * h * a1, x2 = x + 0.5 * h * v;
      const Vector a2 = accelerate(x2, v2), v3 = v + 0.5 * h * a2, x3 = x + 0.5 * h * v2;
      const Vector a3 = accelerate(x3, v3), v4 = v + h * a3, x4 = x + h * v3;
      const Vector a4 = accelerate(x4, v4);
      x += h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4);
      v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
      return;
    }
    case Integrator::verlet: {
      v += 0.5 * h * accelerate(x, v);
      x += h * v;
      v += 0.5 * h * accelerate(x, v);
      return;
    }
    default: {  // semi-implicit Euler
      v += h * accelerate(x, v);
      x += h * v;
      return;
    }
  }
}

/// Longest step [s] for which an oscillator of angular frequency omega [rad/s] and damping ratio zeta does
/// not grow: infinity for implicit integrators, 0 for explicit Euler and RK2 without damping.
double longest_stable_step(Integrator integrator, double omega, double zeta);

}  // namespace palpate
