// Bending frequencies of a cantilever by beam theory.
#pragma once

#include <Eigen/LU>
#include <cmath>
#include <unsupported/Eigen/MatrixFunctions>
#include <vector>

namespace palpate::test {

/// A straight beam in the plane, clamped at x = 0, free at x = length. SI units.
struct Beam {
  double length;
  double mass;            ///< density times section, a length [kg/m]
  double bending;         ///< E I [N m^2]
  double shear;           ///< kappa G A [N]; infinite in Euler and Bernoulli's theory
  double rotary_inertia;  ///< density I, a length [kg m]; 0 in Euler and Bernoulli's theory
};

/// Zero where the beam has the angular frequency omega: Timoshenko's equations (1921) for w, psi, M, V over
/// x,
///   w' = psi + V / (kappa G A),  psi' = M / (E I),  V' = -omega^2 density A w,
///   M' = -V - omega^2 density I psi,
/// carry M = V = 0 at the tip back to the clamp's unknown M and V.
inline double frequency_equation(const Beam& beam, double omega) {
  const double square = omega * omega;
  Eigen::Matrix4d A;
  A << 0.0, 1.0, 0.0, 1.0 / beam.shear,               // w'
      0.0, 0.0, 1.0 / beam.bending, 0.0,              // psi'
      0.0, -square * beam.rotary_inertia, 0.0, -1.0,  // M'
      -square * beam.mass, 0.0, 0.0, 0.0;             // V'
  const Eigen::Matrix4d along = (A * beam.length).exp();
  return along.bottomRightCorner<2, 2>().determinant();
}

/// The lowest angular frequencies [rad/s], by bisection between changes of sign `scan` apart.
inline std::vector<double> frequencies(const Beam& beam, std::size_t count, double scan) {
  std::vector<double> found;
  for (int k = 1; found.size() < count; ++k) {
    double a = k * scan, b = a + scan;
    const bool sign = frequency_equation(beam, a) > 0.0;
    if ((frequency_equation(beam, b) > 0.0) == sign) continue;
    while (b - a > 1e-10 * b) {
      const double middle = 0.5 * (a + b);
      ((frequency_equation(beam, middle) > 0.0) == sign ? a : b) = middle;
    }
    found.push_back(0.5 * (a + b));
  }
  return found;
}

}  // namespace palpate::test
