// Mass, modes and the inverse of Newmark's method against dense matrices and closed forms.
#include "precompute/numerics/dynamics.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "base/error.h"
#include "meshes/surface.h"
#include "precompute/numerics/lowest_modes.h"
#include "tests/support/bodies/make_dynamics.h"
#include "tests/support/bodies/precompute_case.h"
#include "tests/support/bodies/precompute_kinds.h"
#include "tests/support/second_routes/dense_algebra.h"

namespace palpate::dynamics_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

const Material soft{1.0e4, 0.4, 1100.0};
const Vec3 size(0.1, 0.07, 0.05);

bool at_left(const Vec3& x) {
  return x.x() < 1e-9;
}
bool at_right(const Vec3& x) {
  return x.x() > size.x() - 1e-9;
}

/// Distorted block of the kind, clamped at its left and held along the first axis at its right.
test::ElasticCase partly_held_block(const test::Kind& kind) {
  test::ElasticCase result(test::distorted_block(kind.element, size, {4, 3, 2}), soft);
  result.analysis = kind.analysis;
  result.thickness = kind.dimension() == 2 ? 0.02 : 1.0;
  return result.hold(at_left, kind.dimension() == 2 ? 3 : 7).hold(at_right, 1);
}

/// A model of it whose nodes that can move are stored in a shuffled order.
Model model_of(const test::ElasticCase& elastic) {
  Model model;
  model.name = "block";
  model.mesh = elastic.mesh;
  model.surface = surface_simplices(extract_surface(model.mesh));
  model.analysis = elastic.analysis;
  model.thickness = elastic.thickness;
  model.materials = elastic.materials;
  model.material_of_element = elastic.material_of_element;
  model.fixed = elastic.fixed;
  model.rest_force.assign(model.mesh.nodes.size(), Vec3::Zero());
  model.rest_displacement.assign(model.mesh.nodes.size(), Vec3::Zero());
  model.scope = Scope::full;
  for (std::size_t node = 0; node < model.fixed.size(); ++node)
    if (model.fixed[node] != (1 << model.dimension()) - 1)
      model.stored_nodes.push_back(static_cast<Index>(node));
  std::shuffle(model.stored_nodes.begin(), model.stored_nodes.end(), std::mt19937(5));
  return model;
}

MatrixXd dense(const SparseMatrix& lower) {
  return MatrixXd(lower).selfadjointView<Eigen::Lower>();
}

/// What the body's oscillations are made from.
struct Body {
  test::ElasticCase elastic;
  Stiffness stiffness;
  SparseMatrix M;
  Factor factor;

  explicit Body(test::ElasticCase of, bool lumped = false)
      : elastic(std::move(of)),
        stiffness(assemble_stiffness(elastic.body())),
        M(assemble_mass(elastic.body(), stiffness, lumped)),
        factor(stiffness.K, stiffness.node_start) {
    factor.factorize();
  }

  [[nodiscard]] LowestModes modes(std::int64_t count) const {
    return *lowest_modes(factor, stiffness.K, M, count, [] { return false; });
  }
};

/// omega^2 of all modes by a dense solver, and the residual and the masses of the modes that were found.
void expect_modes(const Body& body, std::int64_t count) {
  const MatrixXd K = dense(body.stiffness.K), M = dense(body.M);
  const VectorXd squares = test::eigenvalues_of(K, M);
  const LowestModes modes = body.modes(count);
  ASSERT_EQ(std::ssize(modes.omega), count + 1);
  ASSERT_EQ(modes.shapes.cols(), count);
  for (std::int64_t i = 0; i <= count; ++i) {
    const double omega = modes.omega[static_cast<std::size_t>(i)];
    if (i == K.rows()) {
      EXPECT_EQ(omega, std::numeric_limits<double>::infinity());
      continue;
    }
    EXPECT_NEAR(omega * omega / squares[i], 1.0, 1e-8) << "mode " << i;
    if (i == count) continue;
    const VectorXd phi = modes.shapes.col(i);
    EXPECT_LT((K * phi - omega * omega * (M * phi)).norm(), 1e-8 * (K * phi).norm()) << "mode " << i;
    EXPECT_EQ(phi.maxCoeff(), phi.cwiseAbs().maxCoeff());
  }
  EXPECT_TRUE((modes.shapes.transpose() * M * modes.shapes).isIdentity(1e-8));
}

class DynamicsOfKind : public ::testing::TestWithParam<test::Kind> {};

TEST_P(DynamicsOfKind, MassOfATranslationIsTheBodys) {
  test::ElasticCase free(test::distorted_block(GetParam().element, size, {4, 3, 2}), soft);
  const int d = GetParam().dimension();
  free.thickness = d == 2 ? 0.02 : 1.0;
  double volume = free.thickness;
  for (int axis = 0; axis < d; ++axis) volume *= size[axis];
  const Stiffness stiffness = assemble_stiffness(free.body());
  for (const bool lumped : {false, true}) {
    const SparseMatrix M = assemble_mass(free.body(), stiffness, lumped);
    for (int axis = 0; axis < d; ++axis) {
      VectorXd v = VectorXd::Zero(M.rows());
      for (Eigen::Index dof = axis; dof < v.size(); dof += d) v[dof] = 2.0;
      const double energy = 0.5 * v.dot(VectorXd(M.selfadjointView<Eigen::Lower>() * v));
      EXPECT_NEAR(energy / (2.0 * soft.density * volume), 1.0, 1e-12);
    }
    EXPECT_EQ(dense(M).isDiagonal(0.0), lumped);
  }
}

TEST_P(DynamicsOfKind, LowestModesAreThoseOfTheDenseProblem) {
  for (const bool lumped : {false, true}) {
    SCOPED_TRACE(lumped ? "lumped" : "consistent");
    const Body body(partly_held_block(GetParam()), lumped);
    expect_modes(body, 4);
  }
}

TEST_P(DynamicsOfKind, AllModesAreThoseOfTheDenseProblem) {
  const Body body(partly_held_block(GetParam()));
  expect_modes(body, body.stiffness.K.rows());
}

TEST_P(DynamicsOfKind, PackedInverseIsThatOfKBar) {
  const test::ElasticCase elastic = partly_held_block(GetParam());
  const Model model = model_of(elastic);
  DynamicsOptions options;
  options.method = DynamicsMethod::packed;
  options.newmark = {.alpha = 0.3, .delta = 0.55, .time_step = 0.002};
  options.damping = {.mass = 3.0, .stiffness = 1e-4};
  const StoredDynamics dynamics = test::make_dynamics(model, options, Precision::double_precision);
  ASSERT_EQ(dynamics.inverse.order(), model.stored_dofs());

  // K + a0 M + a1 C_d from what is stored, the held dofs cut out.
  const Stiffness stiffness = assemble_stiffness(stiffness_input(model));
  const std::vector<std::int64_t> dofs = stored_dofs_of(model, stiffness);
  const MatrixXd K = dense(stiffness.K);
  std::vector<std::int64_t> free;
  for (std::size_t s = 0; s < dofs.size(); ++s)
    if (dofs[s] >= 0) free.push_back(static_cast<std::int64_t>(s));
  ASSERT_EQ(std::ssize(free), K.rows());
  const auto n = static_cast<Eigen::Index>(dofs.size());
  MatrixXd M = MatrixXd::Zero(n, n), C = M;
  for (std::size_t j = 0; j < dofs.size(); ++j) {
    for (auto k = static_cast<std::size_t>(dynamics.matrices.start[j]);
         k < static_cast<std::size_t>(dynamics.matrices.start[j + 1]); ++k) {
      const auto column = static_cast<Eigen::Index>(j), row = Eigen::Index{dynamics.matrices.row[k]};
      EXPECT_GE(row, column);
      M(row, column) = M(column, row) = dynamics.matrices.mass[k];
      C(row, column) = C(column, row) = dynamics.matrices.damping[k];
    }
  }
  MatrixXd K_bar(K.rows(), K.rows()), inverse(K.rows(), K.rows());
  for (Eigen::Index i = 0; i < K.rows(); ++i) {
    for (Eigen::Index j = 0; j < K.rows(); ++j) {
      const std::int64_t a = free[static_cast<std::size_t>(i)], b = free[static_cast<std::size_t>(j)];
      const double k_ab = K(dofs[static_cast<std::size_t>(a)], dofs[static_cast<std::size_t>(b)]);
      K_bar(i, j) = k_ab + options.newmark.a0() * M(a, b) + options.newmark.a1() * C(a, b);
      const double expected = 3.0 * M(a, b) + 1e-4 * k_ab;
      EXPECT_NEAR(C(a, b), expected, 1e-14 * C(a, a) + 1e-14);
      inverse(i, j) = dynamics.inverse(a, b);
    }
  }
  EXPECT_TRUE((inverse * K_bar).isIdentity(1e-10));
  for (std::size_t s = 0; s < dofs.size(); ++s) {
    if (dofs[s] >= 0) continue;
    EXPECT_EQ(dynamics.matrices.start[s], dynamics.matrices.start[s + 1]);
    for (std::int64_t i = 0; i < n; ++i) EXPECT_EQ(dynamics.inverse(i, static_cast<std::int64_t>(s)), 0.0);
  }
}

INSTANTIATE_TEST_SUITE_P(All, DynamicsOfKind, ::testing::ValuesIn(test::all_kinds), test::name_of);

/// A beam of square section bends at the same frequency in two directions.
TEST(Modes, TwiceTheSameFrequencyIsFoundTwice) {
  test::ElasticCase beam(test::block(ElementType::hex8, {0.2, 0.02, 0.02}, {16, 2, 2}), soft);
  const Body body(beam.hold(at_left, 7));
  expect_modes(body, 20);
  const LowestModes modes = body.modes(2);
  EXPECT_NEAR(modes.omega[1] / modes.omega[0], 1.0, 1e-9);
  EXPECT_EQ(modes_below(body.factor, body.stiffness.K, body.M, 0.5 * std::pow(modes.omega[0], 2)), 0);
  EXPECT_EQ(modes_below(body.factor, body.stiffness.K, body.M, 1.01 * std::pow(modes.omega[0], 2)), 2);
}

TEST(Modes, OneThatIsLeftOutIsNoticed) {
  const Body body(partly_held_block({ElementType::tet4, Analysis::solid}));
  std::vector<double> omega = body.modes(8).omega;
  EXPECT_TRUE(none_left_out(body.factor, body.stiffness.K, body.M, omega));
  omega.erase(omega.begin() + 3);
  EXPECT_FALSE(none_left_out(body.factor, body.stiffness.K, body.M, omega));
}

/// Ten beams that do not touch have each frequency ten times, those of square section twenty times: more than
/// one starting vector tells apart.
TEST(Modes, AFrequencyOfManyShapesIsFoundAsOften) {
  const Mesh beam = test::block(ElementType::hex8, {0.2, 0.02, 0.02}, {6, 1, 1});
  Mesh beams = beam;
  for (Index i = 1; i < 10; ++i) {
    const auto before = static_cast<Index>(beams.nodes.size());
    for (const Vec3& x : beam.nodes) beams.nodes.push_back(x + Vec3(0.0, 0.05 * i, 0.0));
    for (const Index node : beam.connectivity) beams.connectivity.push_back(node + before);
  }
  test::ElasticCase all(beams, soft);
  const Body body(all.hold(at_left, 7));
  expect_modes(body, 45);
  const LowestModes modes = body.modes(20);
  EXPECT_NEAR(modes.omega[19] / modes.omega[0], 1.0, 1e-9);
  EXPECT_GT(modes.omega[20] / modes.omega[0], 1.5);
}

/// Fronts of more columns than are eliminated together; against all omega^2 by a dense solver.
TEST(Modes, AreCountedBelowAnyFrequency) {
  test::ElasticCase block(test::distorted_block(ElementType::hex8, size, {6, 6, 6}), soft);
  const Body body(block.hold(at_left, 7));
  const VectorXd squares = test::eigenvalues_of(dense(body.stiffness.K), dense(body.M));
  for (Eigen::Index i = 0; i < squares.size(); i += 40) {
    const double below = i == 0 ? 0.0 : squares[i - 1];
    if (squares[i] - below < 1e-6 * squares[i]) continue;
    EXPECT_EQ(modes_below(body.factor, body.stiffness.K, body.M, (below + squares[i]) / 2.0), i);
  }
}

TEST(Modes, AreTheSameAgainAndNoneWhereStopped) {
  test::ElasticCase beam(test::block(ElementType::hex8, {0.2, 0.02, 0.02}, {16, 2, 2}), soft);
  const Body body(beam.hold(at_left, 7));
  const LowestModes expected = body.modes(30), modes = body.modes(30);
  EXPECT_EQ(modes.omega, expected.omega);
  EXPECT_EQ(modes.shapes, expected.shapes);
  for (const int solve : {1, 2, 10, 50}) {
    const auto stopped = [left = solve]() mutable { return --left == 0; };
    EXPECT_FALSE(lowest_modes(body.factor, body.stiffness.K, body.M, 30, stopped)) << "at solve " << solve;
  }
}

/// A bar that is held at its left and free to thin moves along itself with omega_i = (2 i - 1) pi / 2
/// sqrt(E / density) / L (nu = 0).
TEST(Modes, BarMovesAlongItselfAsItsClosedFormSays) {
  constexpr double length = 0.5;
  test::ElasticCase bar(test::block(ElementType::hex8, {length, 0.01, 0.01}, {64, 1, 1}),
                        {1.0e4, 0.0, 1100.0});
  const Body body(bar.hold([](const Vec3&) { return true; }, 6).hold(at_left, 7));
  const LowestModes modes = body.modes(3);
  for (int i = 1; i <= 3; ++i) {
    const double exact = (2 * i - 1) * std::acos(-1.0) / 2.0 * std::sqrt(1.0e4 / 1100.0) / length;
    // linear elements with a consistent mass: too stiff by (k h)^2 / 24
    const double k_h = (2 * i - 1) * std::acos(-1.0) / 2.0 / 64;
    EXPECT_NEAR(modes.omega[static_cast<std::size_t>(i - 1)] / exact, 1.0 + k_h * k_h / 24.0, 1e-5);
  }
}

TEST(Dynamics, ModalIsWhatTheModesSayAtTheStoredDofs) {
  const Model model = model_of(partly_held_block({ElementType::quad4, Analysis::plane_stress}));
  DynamicsOptions options;
  options.method = DynamicsMethod::modal;
  options.modes = 3;
  const StoredDynamics dynamics = test::make_dynamics(model, options, Precision::single_precision);
  const Body body(partly_held_block({ElementType::quad4, Analysis::plane_stress}));
  const LowestModes modes = body.modes(3);
  ASSERT_EQ(dynamics.modes(), 3);
  const std::vector<std::int64_t> dofs = stored_dofs_of(model, body.stiffness);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(dynamics.omega[i] / modes.omega[i], 1.0, 1e-12);
    for (std::size_t s = 0; s < dofs.size(); ++s)
      EXPECT_NEAR(dynamics.shapes[i * dofs.size() + s],
                  dofs[s] < 0 ? 0.0 : modes.shapes(dofs[s], static_cast<Eigen::Index>(i)), 1e-9);
  }
}

/// 10 GB/s read n (n + 1) / 2 numbers of 4 bytes in a millisecond up to n = 2235.
TEST(Dynamics, TakesThePackedInverseWhereItIsReadInATimeStep) {
  const SparseMatrix K(300, 300);
  const auto method = [&](Scope scope, std::int64_t n, Precision precision) {
    return plan_dynamics({}, scope, n, K, precision).method;
  };
  EXPECT_EQ(method(Scope::full, 2235, Precision::single_precision), DynamicsMethod::packed);
  EXPECT_EQ(method(Scope::full, 2236, Precision::single_precision), DynamicsMethod::modal);
  EXPECT_EQ(method(Scope::full, 2235, Precision::double_precision), DynamicsMethod::modal);
  EXPECT_EQ(method(Scope::layers, 30, Precision::single_precision), DynamicsMethod::modal);
}

TEST(Dynamics, RefusesWhatCannotBe) {
  const SparseMatrix K(300, 300);
  DynamicsOptions options;
  options.modes = 301;
  EXPECT_THROW(plan_dynamics(options, Scope::surface, 90, K, Precision::single_precision), Error);
  options.method = DynamicsMethod::packed;
  EXPECT_THROW(plan_dynamics(options, Scope::surface, 90, K, Precision::single_precision), Error);
}

}  // namespace
}  // namespace palpate::dynamics_test
