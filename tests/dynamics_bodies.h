// What the tests of the time integrators let swing.
#pragma once

#include "tests/integrators.h"

namespace palpate::test {

inline SparseMatrix one_by_one(double value) {
  SparseMatrix matrix(1, 1);
  matrix.insert(0, 0) = value;
  matrix.makeCompressed();
  return matrix;
}

inline Eigen::VectorXd scalar(double value) {
  return Eigen::VectorXd::Constant(1, value);
}

/// u'' + 2 zeta omega u' + omega^2 u = force, of a mass of 1 kg.
inline Equation oscillator(double omega, double zeta = 0.0, double force = 0.0) {
  return {.M = one_by_one(1.0),
          .K = one_by_one(omega * omega),
          .C = one_by_one(2.0 * zeta * omega),
          .f = [force](double) { return scalar(force); }};
}

}  // namespace palpate::test
