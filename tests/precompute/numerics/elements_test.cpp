// Assembled bodies of every kind of element: patch test and order of convergence.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "meshes/element.h"
#include "meshes/topology.h"
#include "precompute/numerics/factor.h"
#include "tests/support/bodies/precompute_case.h"
#include "tests/support/bodies/precompute_kinds.h"
#include "tests/support/second_routes/gauss_rules.h"

namespace palpate::elements_test {
namespace {

using test::ElasticCase;
using test::Kind;

const Material tissue{3.0e4, 0.3, 1000.0};

class AssembledKind : public testing::TestWithParam<Kind> {};
INSTANTIATE_TEST_SUITE_P(Kinds, AssembledKind, testing::ValuesIn(test::all_kinds), test::name_of);

/// A body all of whose boundary is held at exact(x).
template <class Exact>
ElasticCase held_on_the_boundary(const Kind& kind, Mesh mesh, const Vec3& size, Exact exact) {
  ElasticCase body(std::move(mesh), tissue);
  body.analysis = kind.analysis;
  if (kind.dimension() == 2) body.thickness = 0.02;
  body.hold([&](const Vec3& x) { return test::on_boundary(x, size, kind.dimension()); }, 7);
  for (std::size_t node = 0; node < body.mesh.nodes.size(); ++node) {
    if (body.fixed[node] != 0) body.prescribed[node] = exact(body.mesh.nodes[node]);
  }
  return body;
}

/// Displacement of all nodes under nodal forces: K u = f - held_force.
std::vector<Vec3> displacement(const ElasticCase& body, const std::vector<Vec3>& force) {
  const Stiffness stiffness = assemble_stiffness(body.body());
  const int d = body.mesh.dimension();
  const auto node_of = [&](std::size_t k) { return static_cast<std::size_t>(stiffness.free_dofs[k] / d); };
  const auto axis_of = [&](std::size_t k) { return stiffness.free_dofs[k] % d; };
  std::vector<double> f(stiffness.free_dofs.size());
  for (std::size_t k = 0; k < f.size(); ++k) f[k] = force[node_of(k)][axis_of(k)] - stiffness.held_force[k];
  Factor factor(stiffness.K, stiffness.node_start);
  factor.factorize();
  const std::vector<double> u_free = factor.solve(f);
  std::vector<Vec3> u = body.prescribed;
  for (std::size_t k = 0; k < f.size(); ++k) u[node_of(k)][axis_of(k)] = u_free[k];
  return u;
}

/// Values of u at the nodes of an element. [nodes, 3]
ElementNodes values_of(const std::vector<Vec3>& u, std::span<const Index> nodes) {
  ElementNodes values(static_cast<Eigen::Index>(nodes.size()), 3);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    values.row(static_cast<Eigen::Index>(i)) = u[static_cast<std::size_t>(nodes[i])];
  }
  return values;
}

/// Sum of N_i times row i.
Vec3 interpolate(const ElementNodes& values, const ShapeValues& N) {
  Vec3 sum = Vec3::Zero();
  for (Eigen::Index i = 0; i < N.size(); ++i) sum += N[i] * values.row(i).transpose();
  return sum;
}

// --- patch test ---

TEST_P(AssembledKind, PatchTestOnADistortedMesh) {
  const Kind kind = GetParam();
  const int d = kind.dimension();
  const Vec3 size(0.3, 0.2, 0.25);
  Mat3 G;
  G << 1e-3, 2e-3, -5e-4, 4e-4, -2e-3, 1e-3, 3e-4, -6e-4, 1.5e-3;
  if (d == 2) G.row(2).setZero();
  const auto exact = [&](const Vec3& x) -> Vec3 { return G * x + Vec3(1e-4, -2e-4, d == 3 ? 3e-4 : 0.0); };
  const ElasticCase body =
      held_on_the_boundary(kind, test::distorted_block(kind.element, size, {4, 3, 4}), size, exact);
  const std::vector<Vec3> u = displacement(body, std::vector<Vec3>(body.mesh.nodes.size(), Vec3::Zero()));

  double largest = 0.0, error = 0.0;
  std::size_t inner = 0;
  for (std::size_t node = 0; node < u.size(); ++node) {
    largest = std::max(largest, exact(body.mesh.nodes[node]).norm());
    error = std::max(error, (u[node] - exact(body.mesh.nodes[node])).norm());
    inner += body.fixed[node] == 0 ? 1 : 0;
  }
  EXPECT_LT(error, 1e-12 * largest);
  EXPECT_GE(inner, d == 2 ? 6u : 18u);

  const ElasticityMatrix D = elasticity_matrix(tissue, kind.analysis);
  Eigen::VectorXd strain(6);
  strain << G(0, 0), G(1, 1), G(2, 2), G(0, 1) + G(1, 0), G(1, 2) + G(2, 1), G(2, 0) + G(0, 2);
  if (d == 2) strain = Vec3(strain[0], strain[1], strain[3]);
  const Eigen::VectorXd stress = D * strain;
  for (Index e = 0; e < body.mesh.elements(); ++e) {
    const ElementNodes x = element_nodes(body.mesh, e);
    const Eigen::MatrixXd u_e = values_of(u, body.mesh.element_nodes(e)).leftCols(d).transpose();
    for (const QuadraturePoint& q : quadrature(kind.element)) {
      const Eigen::MatrixXd B = strain_matrix(mapped_gradients(kind.element, x, q.xi).gradients);
      const Eigen::VectorXd found = D * (B * u_e.reshaped());
      ASSERT_LT((found - stress).norm(), 1e-11 * stress.norm()) << "element " << e;
    }
  }
}

// --- method of manufactured solutions ---

/// u_i = a_i product over k of sin(w_ik x_k + p_ik): smooth, without symmetry, and easy to derive.
class Manufactured {
 public:
  explicit Manufactured(int dimension) : d_(dimension) {
    a_ << 0.02, -0.015, 0.01;
    w_ << 2.1, 1.3, 1.7, 1.1, 2.3, 0.9, 1.5, 1.9, 1.2;
    p_ << 0.3, 0.8, 0.5, 1.1, 0.2, 0.7, 0.6, 0.4, 0.9;
    if (d_ == 2) a_[2] = 0.0;
  }

  /// Derivative of u_i, `times[k]` times along axis k.
  [[nodiscard]] double derivative(int i, const Vec3& x, const std::array<int, 3>& times) const {
    double product = a_[i];
    for (int k = 0; k < d_; ++k) {
      const int n = times[static_cast<std::size_t>(k)];
      product *= std::pow(w_(i, k), n) * std::sin(w_(i, k) * x[k] + p_(i, k) + n * std::numbers::pi / 2.0);
    }
    return product;
  }

  [[nodiscard]] Vec3 displacement(const Vec3& x) const {
    return {derivative(0, x, {}), derivative(1, x, {}), derivative(2, x, {})};
  }

  /// The force that keeps u in equilibrium: b = -div sigma = -(lambda + mu) grad div u - mu laplace u.
  [[nodiscard]] Vec3 body_force(const Vec3& x, double lambda, double mu) const {
    Vec3 b = Vec3::Zero();
    for (int i = 0; i < d_; ++i) {
      for (int k = 0; k < d_; ++k) {
        std::array<int, 3> ik{}, kk{};
        ++ik[static_cast<std::size_t>(i)];
        ++ik[static_cast<std::size_t>(k)];
        kk[static_cast<std::size_t>(k)] = 2;
        b[i] -= (lambda + mu) * derivative(k, x, ik) + mu * derivative(i, x, kk);
      }
    }
    return b;
  }

 private:
  int d_;
  Vec3 a_;
  Mat3 w_, p_;
};

/// Lame's lambda; in plane stress the one that acts in the plane.
double lambda_of(const Material& m, Analysis analysis) {
  const double E = m.youngs_modulus, nu = m.poissons_ratio;
  return analysis == Analysis::plane_stress ? E * nu / (1.0 - nu * nu)
                                            : E * nu / (1.0 + nu) / (1.0 - 2.0 * nu);
}

/// Calls f(x, N, dV, element nodes) at the points of a rule of high order in every element.
template <class F>
void integrate(const Mesh& mesh, F f) {
  const std::vector<QuadraturePoint> rule =
      test::gauss_rule(mesh.element, mesh.element == ElementType::tet10 ? 4 : 3);
  for (Index e = 0; e < mesh.elements(); ++e) {
    const ElementNodes nodes = element_nodes(mesh, e);
    for (const QuadraturePoint& q : rule) {
      const ShapeValues N = shape_functions(mesh.element, q.xi);
      const Vec3 x = interpolate(nodes, N);
      f(x, N, q.weight * mapped_gradients(mesh.element, nodes, q.xi).determinant, mesh.element_nodes(e));
    }
  }
}

/// Error of the displacement in the L2 norm on a unit block of n cells a side, bent inside so that no element
/// is like another.
double manufactured_error(const Kind& kind, int n) {
  const int d = kind.dimension();
  const Manufactured solution(d);
  const auto bend = [d](const Vec3& x) -> Vec3 {
    double bump = 0.05;
    for (int k = 0; k < d; ++k) bump *= std::sin(std::numbers::pi * x[k]);
    return x + bump * Vec3(1.0, -0.8, d == 3 ? 0.6 : 0.0);
  };
  const ElasticCase body =
      held_on_the_boundary(kind, test::block(kind.element, Vec3::Ones(), {n, n, n}, bend), Vec3::Ones(),
                           [&](const Vec3& x) { return solution.displacement(x); });

  const double lambda = lambda_of(tissue, kind.analysis),
               mu = tissue.youngs_modulus / 2.0 / (1.0 + tissue.poissons_ratio);
  std::vector<Vec3> force(body.mesh.nodes.size(), Vec3::Zero());
  integrate(body.mesh, [&](const Vec3& x, const ShapeValues& N, double dV, std::span<const Index> nodes) {
    const Vec3 b = body.thickness * dV * solution.body_force(x, lambda, mu);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      force[static_cast<std::size_t>(nodes[i])] += N[static_cast<Eigen::Index>(i)] * b;
    }
  });
  const std::vector<Vec3> u = displacement(body, force);
  double squared = 0.0;
  integrate(body.mesh, [&](const Vec3& x, const ShapeValues& N, double dV, std::span<const Index> nodes) {
    const Vec3 u_h = interpolate(values_of(u, nodes), N);
    squared += dV * (u_h - solution.displacement(x)).squaredNorm();
  });
  return std::sqrt(squared);
}

TEST_P(AssembledKind, ConvergesWithTheOrderOfItsShapeFunctions) {
  const bool quadratic = GetParam().element == ElementType::tet10;
  const int finest = GetParam().dimension() == 2 ? 64 : quadratic ? 8 : 16;
  const double coarse = manufactured_error(GetParam(), finest / 4),
               middle = manufactured_error(GetParam(), finest / 2),
               fine = manufactured_error(GetParam(), finest);
  RecordProperty("order", std::to_string(std::log2(middle / fine)));
  EXPECT_NEAR(std::log2(middle / fine), quadratic ? 3.0 : 2.0, 0.15);
  EXPECT_NEAR(std::log2(coarse / middle), quadratic ? 3.0 : 2.0, 0.4);
}

// --- locking ---

/// Displacement along a force on a quarter of the top of a cube that is held below, over the force [m/N].
double given_way(ElementType element, double nu) {
  ElasticCase cube(test::block(element, Vec3::Constant(0.1), {6, 6, 6}), {3.0e4, nu, 1000.0});
  cube.hold([](const Vec3& x) { return x.z() < 1e-9; }, 7);
  std::vector<Vec3> force(cube.mesh.nodes.size(), Vec3::Zero());
  for (const ElementSide& side : boundary_sides(cube.mesh)) {
    const std::vector<Index> nodes = side_nodes(cube.mesh, side);
    const ElementNodes x = positions(cube.mesh, nodes);
    if (x.col(2).minCoeff() < 0.0999 || x.leftCols(2).maxCoeff() > 0.0501) continue;
    const ShapeValues area = facet_shape_integrals(traits(element).facet, x, 1.0);
    for (std::size_t k = 0; k < nodes.size(); ++k)
      force[static_cast<std::size_t>(nodes[k])].z() += area[static_cast<Eigen::Index>(k)] / (0.05 * 0.05);
  }
  const std::vector<Vec3> u = displacement(cube, force);
  double work = 0.0;
  for (std::size_t node = 0; node < u.size(); ++node) work += u[node].dot(force[node]);
  return work;
}

TEST(Tet4a, DoesNotLock) {
  for (const double nu : {0.3, 0.45, 0.49, 0.499}) {
    const double right = given_way(ElementType::tet10, nu);
    EXPECT_NEAR(given_way(ElementType::tet4a, nu) / right, 1.0, 0.025) << nu;
    EXPECT_LT(given_way(ElementType::tet4, nu) / right, nu < 0.4 ? 0.95 : 0.9) << nu;
  }
}

}  // namespace
}  // namespace palpate::elements_test
