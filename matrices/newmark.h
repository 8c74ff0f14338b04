// Newmark's method and Rayleigh damping (theory.md section 5).
#pragma once

#include <cmath>
#include <cstdint>

namespace palpate {

/// Method for the body's dynamics.
enum class DynamicsMethod : std::uint8_t {
  none,    ///< no dynamics in the file
  packed,  ///< all stored dofs by the packed inverse of K_bar = K + a0 M + a1 C_d; scope full
  modal,   ///< lowest modes
};

/// u' = u + Dt v + Dt^2 [(1/2 - alpha) a + alpha a'],  v' = v + Dt [(1 - delta) a + delta a'].
/// Unconditionally stable for delta >= 1/2, alpha >= (delta + 1/2)^2 / 4; alpha = 1/4, delta = 1/2 conserves
/// energy without damping.
struct Newmark {
  double alpha = 0.25;
  double delta = 0.5;
  double time_step = 0.001;  ///< Dt [s]

  /// Smallest alpha that is unconditionally stable with this delta.
  [[nodiscard]] double least_alpha() const noexcept { return 0.25 * (delta + 0.5) * (delta + 0.5); }
  /// True if unconditionally stable, up to rounding: 0.3025 is enough for delta = 0.6.
  [[nodiscard]] bool stable() const noexcept {
    return delta >= 0.5 && alpha >= (1.0 - 1e-12) * least_alpha();
  }

  [[nodiscard]] double a0() const noexcept { return 1.0 / (alpha * time_step * time_step); }
  [[nodiscard]] double a1() const noexcept { return delta / (alpha * time_step); }
  [[nodiscard]] double a2() const noexcept { return 1.0 / (alpha * time_step); }
  [[nodiscard]] double a3() const noexcept { return 0.5 / alpha - 1.0; }
  [[nodiscard]] double a4() const noexcept { return delta / alpha - 1.0; }
  [[nodiscard]] double a5() const noexcept { return 0.5 * time_step * (delta / alpha - 2.0); }
};

/// Rayleigh damping C_d = mass M + stiffness K.
struct Rayleigh {
  double mass = 0.0;       ///< [1/s]
  double stiffness = 0.0;  ///< [s]
};

/// Coefficients with damping ratios zeta (1: critical) at two different angular frequencies [rad/s]:
/// zeta = (mass / omega + stiffness omega) / 2.
inline Rayleigh rayleigh_damping(double omega1, double zeta1, double omega2, double zeta2) noexcept {
  const double span = omega2 * omega2 - omega1 * omega1;
  return {.mass = 2.0 * omega1 * omega2 * (zeta1 * omega2 - zeta2 * omega1) / span,
          .stiffness = 2.0 * (zeta2 * omega2 - zeta1 * omega1) / span};
}

}  // namespace palpate
