// The longest time step with which an integrator is stable on an oscillator, seen in its steps.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>

#include "tests/support/bodies/dynamics_bodies.h"

namespace palpate::test {

/// (u', v') = A (u, v) of one step of an oscillator, seen by taking a step from (1, 0) and one from (0, 1);
/// make(u, v) gives the integrator that starts there.
template <class Make>
Eigen::Matrix2d amplification(Make make) {
  Eigen::Matrix2d A;
  for (int k = 0; k < 2; ++k) {
    const std::unique_ptr<Integrator> integrator = make(scalar(1 - k), scalar(k));
    integrator->step();
    A.col(k) << integrator->u()[0], integrator->v()[0];
  }
  return A;
}

/// Whether no motion of the oscillator grows: both amplification factors, the eigenvalues of its matrix, are
/// within the unit circle.
template <class Make>
bool is_stable(Make make) {
  const Eigen::Matrix2d A = amplification(make);
  const double mean = 0.5 * A.trace(), half = 0.5 * (A(0, 0) - A(1, 1));
  const double square = half * half + A(0, 1) * A(1, 0);  // of what the eigenvalues are off their mean
  const double largest = square < 0.0 ? std::sqrt(mean * mean - square) : std::abs(mean) + std::sqrt(square);
  return largest < 1.0 + 1e-8;
}

/// The longest time step [s] that is stable, by bisection; 0 where `shortest` is not, infinity where
/// `longest` is. stable(Dt).
template <class Stable>
double stability_limit(Stable stable, double shortest, double longest) {
  if (!stable(shortest)) return 0.0;
  if (stable(longest)) return std::numeric_limits<double>::infinity();
  while (longest - shortest > 1e-9 * longest) {
    const double middle = std::sqrt(shortest * longest);
    (stable(middle) ? shortest : longest) = middle;
  }
  return shortest;
}

}  // namespace palpate::test
