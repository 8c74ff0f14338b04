// A cantilever, plucked at its tip: the frequencies of its swing against beam theory and against K phi =
// omega^2 M phi.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "tests/integrators/timoshenko_beam.h"
#include "tests/support/bodies/dynamics_bodies.h"
#include "tests/support/second_routes/dense_algebra.h"

namespace palpate::cantilever_test {
namespace {

using Eigen::VectorXd;
using test::Equation;

// Twenty heights long. Plane stress, Poisson's ratio 0: the clamp then has no Poisson effect, and kappa =
// 5/6.
constexpr double length = 0.4, height = 0.02, thickness = 0.01;
const Material rubber{1.0e5, 0.0, 1000.0};

test::Beam timoshenko() {
  const double A = height * thickness, I = thickness * std::pow(height, 3) / 12.0;
  const double E = rubber.youngs_modulus, G = 0.5 * E;
  return {.length = length,
          .mass = rubber.density * A,
          .bending = E * I,
          .shear = 5.0 / 6.0 * G * A,
          .rotary_inertia = rubber.density * I};
}

test::Beam euler_bernoulli() {
  test::Beam beam = timoshenko();
  beam.shear = std::numeric_limits<double>::infinity();
  beam.rotary_inertia = 0.0;
  return beam;
}

// The roots of cos x cosh x = -1 (Timoshenko, Young and Weaver 1974), omega = x^2 sqrt(E I / (mass
// length^4)).
TEST(Cantilever, FrequencyEquationOfAThinBeam) {
  const test::Beam beam = euler_bernoulli();
  const double scale = std::sqrt(beam.bending / (beam.mass * std::pow(beam.length, 4)));
  const std::vector<double> omega = frequencies(beam, 3, 0.5 * scale);
  const std::array<double, 3> roots = {1.8751040687, 4.6940911330, 7.8547574382};
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(omega[k] / (scale * roots[k] * roots[k]), 1.0, 1e-8);
}

/// The beam in quad4, and a unit force on its tip, across.
struct Cantilever {
  Equation equation;
  VectorXd tip;  ///< [n] force [N]; its product with u is the tip's mean deflection
};

/// Quad4 bends too stiffly, by about (cell length / height)^2 / 2 of the bending stiffness when cells are
/// square: 0.8 % with 8, less than half of that in the frequency.
Cantilever cantilever(int cells_high) {
  const int along = cells_high * static_cast<int>(std::lround(length / height));
  test::ElasticCase body(
      generate(RectangleShape{Vec3::Zero(), {length, height, 0.0}, {along, cells_high}}, ElementType::quad4),
      rubber);
  body.thickness = thickness;
  body.hold([](const Vec3& x) { return x.x() < 1e-9; }, 3);
  const Stiffness stiffness = assemble_stiffness(body.body());
  VectorXd tip = VectorXd::Zero(stiffness.K.rows());
  for (std::size_t node = 0; node < body.mesh.nodes.size(); ++node) {
    if (body.mesh.nodes[node].x() > length - 1e-9)
      tip[stiffness.free_of_dof[2 * node + 1]] = 1.0 / (cells_high + 1);
  }
  return {test::equation_of(body), tip};
}

/// The lowest angular frequencies of K phi = omega^2 M phi [rad/s], by subspace iteration.
std::vector<double> lowest_modes(const Equation& equation, std::size_t count) {
  const auto K = equation.K.selfadjointView<Eigen::Lower>(), M = equation.M.selfadjointView<Eigen::Lower>();
  const test::SparseSolver solver(equation.K);
  Eigen::MatrixXd X = Eigen::MatrixXd::Random(equation.K.rows(), static_cast<Eigen::Index>(2 * count + 2));
  VectorXd squares;
  for (int k = 0; k < 30; ++k) {
    const Eigen::MatrixXd MX = M * X;
    for (Eigen::Index j = 0; j < X.cols(); ++j) X.col(j) = solver.solve(MX.col(j));
    const Eigen::MatrixXd KX = K * X, MX_after = M * X;
    const test::Eigenpairs ritz = test::eigenpairs_of(X.transpose() * KX, X.transpose() * MX_after);
    X = X * ritz.vectors;
    squares = ritz.values;
  }
  std::vector<double> omega;
  for (std::size_t k = 0; k < count; ++k) omega.push_back(std::sqrt(squares[static_cast<Eigen::Index>(k)]));
  return omega;
}

/// |Fourier transform| of a signal under Hann's window, at an angular frequency.
double spectrum(const std::vector<double>& signal, double Dt, double omega) {
  const auto count = static_cast<double>(signal.size());
  const std::complex<double> turn = std::polar(1.0, -omega * Dt);
  std::complex<double> phase = 1.0, sum = 0.0;
  for (std::size_t k = 0; k < signal.size(); ++k, phase *= turn) {
    const double window = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * static_cast<double>(k) / count);
    sum += window * signal[k] * phase;
  }
  return std::abs(sum);
}

/// The lowest `count` peaks of the spectrum over half of the highest one below `end` [rad/s].
std::vector<double> peaks(const std::vector<double>& signal, double Dt, double end, std::size_t count) {
  const double bin = std::numbers::pi / (Dt * static_cast<double>(signal.size()));  // half of a bin
  std::vector<double> values;
  for (int k = 0; k * bin < end; ++k) values.push_back(spectrum(signal, Dt, k * bin));
  const double highest = *std::max_element(values.begin(), values.end());
  std::vector<double> found;
  for (std::size_t k = 1; k + 1 < values.size() && found.size() < count; ++k) {
    if (values[k] < 0.5 * highest || values[k] < values[k - 1] || values[k] < values[k + 1]) continue;
    double a = bin * static_cast<double>(k - 1), b = bin * static_cast<double>(k + 1);
    while (b - a > 1e-8 * b) {  // by thirds: one maximum lies between
      const double left = a + (b - a) / 3.0, right = b - (b - a) / 3.0;
      if (spectrum(signal, Dt, left) < spectrum(signal, Dt, right)) {
        a = left;
      } else {
        b = right;
      }
    }
    found.push_back(0.5 * (a + b));
  }
  return found;
}

// A force on the tip that ends gives each mode an acceleration phi(tip)^2, the same for all: the tip's
// acceleration shows them equally.
TEST(Cantilever, PluckedItSwingsAtTheFrequenciesOfTimoshenkosBeam) {
  const Cantilever beam = cantilever(8);
  const std::vector<double> modes = lowest_modes(beam.equation, 3);
  const double Dt = 0.2 / modes[2], end = 8.0 * 2.0 * std::numbers::pi / modes[0];
  const VectorXd pulled = test::SparseSolver(beam.equation.K).solve(1e-3 * beam.tip);
  test::NewmarkIntegrator newmark(beam.equation, Newmark{.time_step = Dt}, pulled,
                                  VectorXd::Zero(pulled.size()));
  std::vector<double> tip;
  while (newmark.time() < end) {
    newmark.step();
    tip.push_back(beam.tip.dot(newmark.a()));
  }
  const std::vector<double> swing = peaks(tip, Dt, 1.3 * modes[2], 3);
  ASSERT_EQ(swing.size(), 3U);

  const double scan = 0.1 * modes[0];
  const std::vector<double> thick = frequencies(timoshenko(), 3, scan),
                            thin = frequencies(euler_bernoulli(), 3, scan);
  const std::array<double, 3> shear = {0.002, 0.012, 0.027};  // by which Euler-Bernoulli is too high
  for (std::size_t k = 0; k < 3; ++k) {
    const double slower = std::pow(modes[k] * Dt, 2) / 12.0;  // Newmark's period error
    EXPECT_NEAR(swing[k] / modes[k], 1.0 - slower, 5e-5) << "mode " << k + 1;
    EXPECT_NEAR(swing[k] / thick[k], 1.0 - slower, 0.005) << "mode " << k + 1;  // the mesh's 0.4 %
    EXPECT_NEAR(thick[k] / thin[k], 1.0 - shear[k], 0.001) << "mode " << k + 1;
    EXPECT_NEAR(swing[k] / thin[k], 1.0 - slower - shear[k], 0.006) << "mode " << k + 1;
  }
}

// The mesh's error halves twice when the cells are halved, so two meshes together cancel it.
TEST(Cantilever, TheModesOfFineMeshesAreTimoshenkos) {
  const std::vector<double> coarse = lowest_modes(cantilever(4).equation, 3),
                            fine = lowest_modes(cantilever(8).equation, 3),
                            thick = frequencies(timoshenko(), 3, 0.1 * coarse[0]);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(fine[k] / thick[k], 1.0, 0.005) << "mode " << k + 1;
    EXPECT_NEAR((4.0 * fine[k] - coarse[k]) / 3.0 / thick[k], 1.0, 0.0002) << "mode " << k + 1;
  }
}

}  // namespace
}  // namespace palpate::cantilever_test
