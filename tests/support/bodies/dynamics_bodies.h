// What the tests of the time integrators let swing.
#pragma once

#include <Eigen/SparseCore>

#include "meshes/generate.h"
#include "tests/integrators/integrators.h"
#include "tests/support/bodies/precompute_case.h"
#include "tests/support/second_routes/dense_algebra.h"

namespace palpate::test {

inline SparseMatrix one_by_one(double value) {
  return Eigen::MatrixXd::Constant(1, 1, value).sparseView();
}

inline Eigen::VectorXd scalar(double value) {
  return Eigen::VectorXd::Constant(1, value);
}

/// u'' + 2 zeta omega u' + omega^2 u = f(t) [m/s^2], of a mass of 1 kg; no f: none.
inline Equation oscillator(double omega, double zeta = 0.0, const std::function<double(double)>& f = {}) {
  Equation equation{
      .M = one_by_one(1.0), .K = one_by_one(omega * omega), .C = one_by_one(2.0 * zeta * omega), .f = {}};
  if (f) equation.f = [f](double time) { return scalar(f(time)); };
  return equation;
}

/// A body's equation of free motion.
inline Equation equation_of(const ElasticCase& body, bool lumped = false, const Rayleigh& damping = {}) {
  const Stiffness stiffness = assemble_stiffness(body.body());
  const SparseMatrix M = assemble_mass(body.body(), stiffness, lumped);
  return {.M = M, .K = stiffness.K, .C = damping_matrix(M, stiffness.K, damping), .f = {}};
}

/// A block like liver, 100 x 60 x 50 mm of hex8, clamped at x = 0.
inline ElasticCase clamped_block(const std::array<int, 3>& cells) {
  ElasticCase block(generate(BoxShape{Vec3::Zero(), Vec3(0.1, 0.06, 0.05), cells}, ElementType::hex8),
                    Material{5.0e3, 0.45, 1060.0});
  block.hold([](const Vec3& x) { return x.x() < 1e-9; }, 7);
  return block;
}

/// K phi = omega^2 M phi.
struct Modes {
  Eigen::VectorXd omega;   ///< [n] ascending [rad/s]
  Eigen::MatrixXd shapes;  ///< [n, n] columns phi with phi^T M phi = 1
};

inline Modes all_modes(const Equation& equation) {
  const Eigenpairs pairs = eigenpairs_of(Eigen::MatrixXd(equation.K), Eigen::MatrixXd(equation.M));
  return {pairs.values.cwiseSqrt(), pairs.vectors};
}

}  // namespace palpate::test
