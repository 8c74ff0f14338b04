// Elements of every kind against what interpolation, quadrature and elasticity say of them.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <numeric>
#include <random>

#include "meshes/element.h"
#include "tests/gauss_rules.h"

namespace palpate {
namespace {

using test::gauss_rule;
using test::is_simplex;

const Material rubber{2.0e5, 0.42, 1100.0};
constexpr double thickness = 0.013;

std::string name_of(const testing::TestParamInfo<ElementType>& info) {
  return traits(info.param).name;
}

class EveryElement : public testing::TestWithParam<ElementType> {};
INSTANTIATE_TEST_SUITE_P(Kinds, EveryElement,
                         testing::Values(ElementType::line2, ElementType::tri3, ElementType::tri6,
                                         ElementType::quad4, ElementType::tet4, ElementType::tet10,
                                         ElementType::hex8),
                         name_of);
class BodyElement : public testing::TestWithParam<ElementType> {};
INSTANTIATE_TEST_SUITE_P(Kinds, BodyElement, testing::ValuesIn(body_elements), name_of);
class SimplexElement : public testing::TestWithParam<ElementType> {};
INSTANTIATE_TEST_SUITE_P(Kinds, SimplexElement,
                         testing::Values(ElementType::tri3, ElementType::tri6, ElementType::tet4,
                                         ElementType::tet10),
                         name_of);
class FacetElement : public testing::TestWithParam<ElementType> {};
INSTANTIATE_TEST_SUITE_P(Kinds, FacetElement,
                         testing::Values(ElementType::line2, ElementType::tri3, ElementType::tri6,
                                         ElementType::quad4),
                         name_of);

/// Parametric coordinates of the nodes as VTK's documentation gives them: all in [0, 1].
std::vector<Vec3> vtk_nodes(ElementType type) {
  switch (type) {
    case ElementType::line2:
      return {{0, 0, 0}, {1, 0, 0}};
    case ElementType::tri3:
      return {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    case ElementType::tri6:
      return {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.5, 0, 0}, {0.5, 0.5, 0}, {0, 0.5, 0}};
    case ElementType::quad4:
      return {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    case ElementType::tet4:
      return {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    case ElementType::tet10:
      return {{0, 0, 0},   {1, 0, 0},  {0, 1, 0},  {0, 0, 1},   {.5, 0, 0},
              {.5, .5, 0}, {0, .5, 0}, {0, 0, .5}, {.5, 0, .5}, {0, .5, .5}};
    case ElementType::hex8:
      return {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  }
  return {};
}

std::vector<Vec3> nodes_in_reference(ElementType type) {
  std::vector<Vec3> nodes = vtk_nodes(type);
  if (is_simplex(type)) return nodes;
  const int d = traits(type).dimension;
  for (Vec3& xi : nodes) xi.head(d) = 2.0 * xi.head(d).array() - 1.0;
  return nodes;
}

/// Points inside of the reference element: those of a rule of 27 or fewer points.
std::vector<Vec3> inner_points(ElementType type) {
  std::vector<Vec3> points;
  for (const QuadraturePoint& q : gauss_rule(type, 3)) points.push_back(q.xi);
  return points;
}

/// An affine map of the size of an organ's elements, det > 0.
Mat3 some_map() {
  Mat3 A;
  A << 0.03, 0.01, -0.004, -0.006, 0.025, 0.008, 0.005, -0.003, 0.028;
  return A;
}

/// Maps points that lie in VTK's parametric space: into space, or for plane elements into the plane z = 0.
ElementNodes mapped(ElementType type, const std::vector<Vec3>& points) {
  ElementNodes x(traits(type).nodes, 3);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    x.row(i) = some_map() * (points[static_cast<std::size_t>(i)] + Vec3(0.5, -0.25, 0.1));
  }
  if (traits(type).dimension == 2) x.col(2).setZero();
  return x;
}

/// An element no two edges of which are parallel: corners moved at random by up to a tenth; further nodes in
/// the middles of their edges, or with `curved` moved too.
ElementNodes distorted(ElementType type, bool curved = false) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> shift(-0.1, 0.1);
  const std::vector<Vec3> reference = vtk_nodes(type);
  const auto corners = static_cast<std::size_t>(traits(type).corners);
  std::vector<Vec3> moved(reference);
  for (std::size_t i = 0; i < corners; ++i) moved[i] += Vec3(shift(random), shift(random), shift(random));
  for (std::size_t i = corners; i < moved.size(); ++i) {
    moved[i] = Vec3::Zero();  // straight edges: every other node is where the linear simplex takes it
    moved[i] += (1.0 - reference[i].sum()) * moved[0];
    for (std::size_t k = 0; k + 1 < corners; ++k) {
      moved[i] += reference[i][static_cast<Eigen::Index>(k)] * moved[k + 1];
    }
    if (curved) moved[i] += 0.5 * Vec3(shift(random), shift(random), shift(random));
  }
  return mapped(type, moved);
}

/// x^a y^b z^c.
double monomial(const Vec3& x, const std::array<int, 3>& power) {
  return std::pow(x[0], power[0]) * std::pow(x[1], power[1]) * std::pow(x[2], power[2]);
}

/// All powers of d coordinates, each up to `highest`.
std::vector<std::array<int, 3>> powers_up_to(int highest, int d) {
  std::vector<std::array<int, 3>> powers;
  for (int a = 0; a <= highest; ++a) {
    for (int b = 0; b <= (d > 1 ? highest : 0); ++b) {
      for (int c = 0; c <= (d > 2 ? highest : 0); ++c) powers.push_back({a, b, c});
    }
  }
  return powers;
}

// --- interpolation ---

TEST_P(EveryElement, NodesAreNumberedAsInVtk) {
  const std::vector<Vec3> expected = nodes_in_reference(GetParam());
  const std::span<const Vec3> found = reference_nodes(GetParam());
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(found[i], expected[i]) << "node " << i;
}

TEST_P(EveryElement, ShapeFunctionsAreOneAtTheirNodeAndZeroAtTheOthers) {
  const std::vector<Vec3> nodes = nodes_in_reference(GetParam());
  const auto count = static_cast<Eigen::Index>(nodes.size());
  for (Eigen::Index j = 0; j < count; ++j) {
    const Eigen::VectorXd N = shape_functions(GetParam(), nodes[static_cast<std::size_t>(j)]);
    EXPECT_LT((N - Eigen::VectorXd::Unit(count, j)).norm(), 1e-15) << "node " << j;
  }
}

TEST_P(EveryElement, ShapeFunctionsAddUpToOne) {
  for (const Vec3& xi : inner_points(GetParam())) {
    EXPECT_NEAR(shape_functions(GetParam(), xi).sum(), 1.0, 1e-14);
    EXPECT_LT(reference_gradients(GetParam(), xi).colwise().sum().norm(), 1e-14);
  }
}

TEST_P(EveryElement, GradientsAreTheDerivatives) {
  constexpr double h = 1e-4;  // central differences are exact up to second degree, so only rounding remains
  for (const Vec3& xi : inner_points(GetParam())) {
    const ShapeGradients gradients = reference_gradients(GetParam(), xi);
    for (int k = 0; k < traits(GetParam()).dimension; ++k) {
      const Vec3 step = h * Vec3::Unit(k);
      const Eigen::VectorXd ahead = shape_functions(GetParam(), xi + step),
                            behind = shape_functions(GetParam(), xi - step), found = gradients.col(k);
      EXPECT_LT((found - (ahead - behind) / (2.0 * h)).norm(), 1e-11);
    }
  }
}

TEST_P(BodyElement, LinearFieldsAreExactOnDistortedElements) {
  const ElementType type = GetParam();
  const int d = traits(type).dimension;
  const Vec3 gradient = Vec3(1.5, -2.0, d == 3 ? 0.7 : 0.0);
  for (const bool curved : {false, true}) {
    const ElementNodes x = distorted(type, curved);
    const Eigen::VectorXd u = (x * gradient).array() + 0.3;
    for (const Vec3& xi : inner_points(type)) {
      const Vec3 place = x.transpose() * shape_functions(type, xi);
      EXPECT_NEAR(shape_functions(type, xi).dot(u), gradient.dot(place) + 0.3, 1e-14);
      const Eigen::VectorXd found = mapped_gradients(type, x, xi).gradients.transpose() * u;
      EXPECT_LT((found - gradient.head(d)).norm(), 1e-13);
    }
  }
}

TEST_P(SimplexElement, QuadraticFieldsAreExactOnStraightEdgesIfThereAreMiddleNodes) {
  const ElementType type = GetParam();
  const int d = traits(type).dimension;
  const bool quadratic = traits(type).nodes > traits(type).corners;
  const ElementNodes x = distorted(type);
  const double size = x.rowwise().norm().maxCoeff();
  double error = 0.0;  // of u / size^2 and grad u / size
  for (int i = 0; i < d; ++i) {
    for (int j = 0; j <= i; ++j) {
      const Eigen::VectorXd u = x.col(i).cwiseProduct(x.col(j));
      for (const Vec3& xi : inner_points(type)) {
        const Vec3 place = x.transpose() * shape_functions(type, xi);
        const Vec3 gradient = place[j] * Vec3::Unit(i) + place[i] * Vec3::Unit(j);
        const Eigen::VectorXd found = mapped_gradients(type, x, xi).gradients.transpose() * u;
        error =
            std::max(error, std::abs(shape_functions(type, xi).dot(u) - place[i] * place[j]) / size / size);
        error = std::max(error, (found - gradient.head(d)).norm() / size);
      }
    }
  }
  if (quadratic) {
    EXPECT_LT(error, 1e-13);
  } else {
    EXPECT_GT(error, 0.1);
  }
}

// --- quadrature ---

double simplex_integral(const std::array<int, 3>& power, int d) {
  const auto factorial = [](int n) { return std::tgamma(n + 1.0); };
  return factorial(power[0]) * factorial(power[1]) * factorial(power[2]) /
         factorial(power[0] + power[1] + power[2] + d);
}

double cube_integral(const std::array<int, 3>& power, int d) {
  double integral = 1.0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(d); ++k) {
    integral *= power[k] % 2 == 0 ? 2.0 / (power[k] + 1.0) : 0.0;
  }
  return integral;
}

template <class Rule>
double integral(const Rule& rule, const std::array<int, 3>& power) {
  double sum = 0.0;
  for (const QuadraturePoint& q : rule) sum += q.weight * monomial(q.xi, power);
  return sum;
}

/// Checks a rule against the closed forms: simplices to this total degree, cubes to it in each coordinate.
template <class Rule>
void expect_exact(ElementType type, const Rule& rule, int degree) {
  const int d = traits(type).dimension;
  for (const std::array<int, 3>& power : powers_up_to(degree, d)) {
    if (is_simplex(type) && std::accumulate(power.begin(), power.end(), 0) > degree) continue;
    const double exact = is_simplex(type) ? simplex_integral(power, d) : cube_integral(power, d);
    EXPECT_NEAR(integral(rule, power), exact, 1e-14) << power[0] << ' ' << power[1] << ' ' << power[2];
  }
}

bool is_inside(ElementType type, const Vec3& xi) {
  const auto coordinates = xi.head(traits(type).dimension).array();
  if (is_simplex(type)) return (coordinates > 0.0).all() && coordinates.sum() < 1.0;
  return (coordinates.abs() < 1.0).all();
}

TEST_P(EveryElement, QuadratureIsExactToItsDegreeAndNoFurther) {
  struct Expected {
    std::size_t points;
    int degree;
  };
  constexpr std::array<Expected, 7> expected = {{{2, 3}, {1, 1}, {3, 2}, {4, 3}, {1, 1}, {4, 2}, {8, 3}}};
  const auto [points, degree] = expected[static_cast<std::size_t>(GetParam())];
  const std::span<const QuadraturePoint> rule = quadrature(GetParam());
  EXPECT_EQ(rule.size(), points);
  expect_exact(GetParam(), rule, degree);
  const int d = traits(GetParam()).dimension;
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(d); ++axis) {
    std::array<int, 3> next{};
    next[axis] = degree + 1;
    const double exact = is_simplex(GetParam()) ? simplex_integral(next, d) : cube_integral(next, d);
    EXPECT_GT(std::abs(integral(rule, next) - exact), 1e-4);
  }
  for (const QuadraturePoint& q : rule) {  // inside, and positive: so that K is positive semidefinite
    EXPECT_GT(q.weight, 0.0);
    EXPECT_TRUE(is_inside(GetParam(), q.xi)) << q.xi.transpose();
  }
}

TEST_P(EveryElement, TheRuleThatTheTestsCompareWithIsExactToItsDegreeToo) {
  const int n = 4, d = traits(GetParam()).dimension;
  expect_exact(GetParam(), gauss_rule(GetParam(), n), is_simplex(GetParam()) ? 2 * n - d : 2 * n - 1);
}

// --- measures and loads ---

struct Shape {
  ElementNodes x;
  double measure;  ///< length, area or volume
  Vec3 centroid;
};

/// Distorted straight-edged elements with measure and centroid by elementary geometry; hex8 is the frustum of
/// a pyramid under an affine map.
Shape known_shape(ElementType type) {
  const ElementNodes x = distorted(type);
  const auto node = [&](Eigen::Index i) { return Vec3(x.row(i)); };
  const auto area = [&](int i, int j, int k) {
    return 0.5 * (node(j) - node(i)).cross(node(k) - node(i)).norm();
  };
  const Vec3 mean = x.topRows(traits(type).corners).colwise().mean();
  switch (type) {
    case ElementType::line2:
      return {x, (node(1) - node(0)).norm(), mean};
    case ElementType::tri3:
    case ElementType::tri6:
      return {x, area(0, 1, 2), mean};
    case ElementType::tet4:
    case ElementType::tet10:
      return {x, (node(1) - node(0)).cross(node(2) - node(0)).dot(node(3) - node(0)) / 6.0, mean};
    case ElementType::quad4: {
      const double first = area(0, 1, 2), second = area(0, 2, 3);
      const Vec3 moment =
          first * (node(0) + node(1) + node(2)) / 3.0 + second * (node(0) + node(2) + node(3)) / 3.0;
      return {x, first + second, moment / (first + second)};
    }
    case ElementType::hex8:
      break;
  }
  const double a = 1.0, b = 0.4, h = 1.2, sum = a * a + a * b + b * b;
  Shape frustum{ElementNodes(8, 3), h / 3.0 * sum * some_map().determinant(),
                some_map() * Vec3(0, 0, h / 4.0 * (a * a + 2.0 * a * b + 3.0 * b * b) / sum)};
  for (Eigen::Index i = 0; i < 8; ++i) {
    const Vec3 corner = vtk_nodes(type)[static_cast<std::size_t>(i)];
    const double side = corner.z() > 0.0 ? b : a;
    frustum.x.row(i) =
        some_map() * Vec3(side * (corner.x() - 0.5), side * (corner.y() - 0.5), h * corner.z());
  }
  return frustum;
}

/// Sum of the integrals of N_i is the measure, and sum of x_i times them its first moment.
void expect_integrals(const ShapeValues& integrals, const Shape& shape, double factor) {
  EXPECT_NEAR(integrals.sum(), factor * shape.measure, 1e-14 * factor * shape.measure);
  const Vec3 moment = shape.x.transpose() * integrals;
  const double size = shape.x.rowwise().norm().maxCoeff();
  EXPECT_LT((moment - factor * shape.measure * shape.centroid).norm(), 1e-14 * factor * shape.measure * size);
}

TEST_P(BodyElement, VolumeAndShapeIntegrals) {
  const Shape shape = known_shape(GetParam());
  EXPECT_NEAR(element_volume(GetParam(), shape.x), shape.measure, 1e-14 * shape.measure);
  expect_integrals(element_shape_integrals(GetParam(), shape.x, thickness), shape, thickness);
}

TEST_P(FacetElement, MeasureAndShapeIntegralsInSpace) {
  Shape shape = known_shape(GetParam());
  const Mat3 turn =
      (Eigen::AngleAxisd(0.7, Vec3::UnitX()) * Eigen::AngleAxisd(-1.1, Vec3::UnitZ())).toRotationMatrix();
  shape.x = ElementNodes(shape.x * turn.transpose());
  shape.centroid = turn * shape.centroid;
  expect_integrals(facet_shape_integrals(GetParam(), shape.x, thickness), shape, thickness);
  double measure = 0.0;
  for (const QuadraturePoint& q : gauss_rule(GetParam(), 3)) {
    measure += q.weight * facet_measure(GetParam(), shape.x, q.xi);
  }
  EXPECT_NEAR(measure, shape.measure, 1e-14 * shape.measure);
}

// Integrals of the quadratic shape functions: -V/20 and V/5 over a tetrahedron, 0 and A/3 over a triangle.
TEST(QuadraticElement, ShapeIntegralsOfCornersAndMiddles) {
  const Shape tet = known_shape(ElementType::tet10), triangle = known_shape(ElementType::tri6);
  const ShapeValues in_tet = element_shape_integrals(ElementType::tet10, tet.x, 1.0),
                    on_triangle = facet_shape_integrals(ElementType::tri6, triangle.x, 1.0);
  EXPECT_LT((in_tet.head(4).array() + tet.measure / 20.0).abs().maxCoeff(), 1e-14 * tet.measure);
  EXPECT_LT((in_tet.tail(6).array() - tet.measure / 5.0).abs().maxCoeff(), 1e-14 * tet.measure);
  EXPECT_LT(on_triangle.head(3).array().abs().maxCoeff(), 1e-14 * triangle.measure);
  EXPECT_LT((on_triangle.tail(3).array() - triangle.measure / 3.0).abs().maxCoeff(),
            1e-14 * triangle.measure);
}

TEST_P(BodyElement, SmallestDeterminantTellsInvertedElements) {
  const ElementNodes x = distorted(GetParam());
  EXPECT_GT(smallest_determinant(GetParam(), x), 0.0);
  const Mat3 mirror = Vec3(1, -1, 1).asDiagonal();
  EXPECT_LT(smallest_determinant(GetParam(), x * mirror), 0.0);
}

TEST(Quad4, AReentrantCornerIsSeenThoughTheAreaIsPositive) {
  ElementNodes dart(4, 3);
  dart << 0, 0, 0, 1, 0, 0, 0.45, 0.45, 0, 0, 1, 0;  // determinants: positive at the quadrature points
  EXPECT_NEAR(element_volume(ElementType::quad4, dart), 0.45, 1e-15);
  EXPECT_LT(smallest_determinant(ElementType::quad4, dart), 0.0);
}

// --- stiffness ---

std::vector<Analysis> analyses(ElementType type) {
  if (traits(type).dimension == 3) return {Analysis::solid};
  return {Analysis::plane_stress, Analysis::plane_strain};
}

/// Lame's lambda; in plane stress the one that acts in the plane.
double lambda_of(Analysis analysis) {
  const double E = rubber.youngs_modulus, nu = rubber.poissons_ratio;
  return analysis == Analysis::plane_stress ? E * nu / (1.0 - nu * nu)
                                            : E * nu / (1.0 + nu) / (1.0 - 2.0 * nu);
}
double mu() {
  return rubber.youngs_modulus / 2.0 / (1.0 + rubber.poissons_ratio);
}

/// lambda g_i g_j^T + mu g_j g_i^T + mu (g_i . g_j) 1 for all pairs of nodes: B^T D B in index notation.
Eigen::MatrixXd energy_density(const Eigen::MatrixXd& g, double lambda) {
  const Eigen::Index d = g.cols();
  Eigen::MatrixXd result(d * g.rows(), d * g.rows());
  for (Eigen::Index i = 0; i < g.rows(); ++i) {
    for (Eigen::Index j = 0; j < g.rows(); ++j) {
      result.block(d * i, d * j, d, d) = lambda * g.row(i).transpose() * g.row(j) +
                                         mu() * g.row(j).transpose() * g.row(i) +
                                         mu() * g.row(i).dot(g.row(j)) * Eigen::MatrixXd::Identity(d, d);
    }
  }
  return result;
}

/// Gradients of the barycentric coordinates: L_i(x) = c_i0 + c_i . x with L_i(x_j) = delta_ij. [d + 1, d]
Eigen::MatrixXd barycentric_gradients(const ElementNodes& x, Eigen::Index d) {
  Eigen::MatrixXd A(d + 1, d + 1);
  A << Eigen::VectorXd::Ones(d + 1), x.topLeftCorner(d + 1, d);
  return A.inverse().bottomRows(d).transpose();
}

TEST_P(SimplexElement, GradientsInSpaceAreTheClosedForm) {
  const ElementType type = GetParam();
  const Eigen::Index d = traits(type).dimension;
  const ElementNodes x = distorted(type);
  const Eigen::MatrixXd dL = barycentric_gradients(x, d);
  const std::vector<Vec3> reference = vtk_nodes(type);
  for (const Vec3& xi : inner_points(type)) {
    Eigen::VectorXd L(d + 1);
    L << 1.0 - xi.sum(), xi.head(d);
    Eigen::MatrixXd expected = dL;
    if (traits(type).nodes > d + 1) {
      expected.resize(traits(type).nodes, d);
      for (Eigen::Index i = 0; i <= d; ++i) expected.row(i) = (4.0 * L[i] - 1.0) * dL.row(i);
      for (Eigen::Index i = d + 1; i < expected.rows(); ++i) {  // N = 4 L_a L_b in the middle of a and b
        const Vec3 middle = reference[static_cast<std::size_t>(i)];
        Eigen::VectorXd at(d + 1);
        at << 1.0 - middle.sum(), middle.head(d);
        std::vector<Eigen::Index> ends;
        for (Eigen::Index k = 0; k <= d; ++k) {
          if (at[k] > 0.0) ends.push_back(k);
        }
        expected.row(i) = 4.0 * (L[ends[0]] * dL.row(ends[1]) + L[ends[1]] * dL.row(ends[0]));
      }
    }
    const Eigen::MatrixXd found = mapped_gradients(type, x, xi).gradients;
    EXPECT_LT((found - expected).norm(), 1e-13 * expected.norm());
  }
}

TEST(LinearSimplex, StiffnessIsTheClosedForm) {
  for (const ElementType type : {ElementType::tri3, ElementType::tet4}) {
    const Shape shape = known_shape(type);
    for (const Analysis analysis : analyses(type)) {
      const Eigen::MatrixXd K =
          element_stiffness(type, shape.x, elasticity_matrix(rubber, analysis), thickness);
      const Eigen::MatrixXd g = barycentric_gradients(shape.x, traits(type).dimension);
      const Eigen::MatrixXd expected = thickness * shape.measure * energy_density(g, lambda_of(analysis));
      EXPECT_LT((K - expected).norm(), 1e-13 * expected.norm());
    }
  }
}

/// Integral of t B^T D B by 4 points in each direction.
Eigen::MatrixXd stiffness_of_high_order(ElementType type, const ElementNodes& x, Analysis analysis) {
  const Eigen::Index dofs = x.rows() * traits(type).dimension;
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(dofs, dofs);
  for (const QuadraturePoint& q : gauss_rule(type, 4)) {
    const MappedGradients g = mapped_gradients(type, x, q.xi);
    K += thickness * q.weight * g.determinant * energy_density(g.gradients, lambda_of(analysis));
  }
  return K;
}

TEST_P(BodyElement, StiffnessIsTheIntegralOnAffineElements) {
  const ElementType type = GetParam();
  const ElementNodes x = is_simplex(type) ? distorted(type) : mapped(type, vtk_nodes(type));
  for (const Analysis analysis : analyses(type)) {
    const Eigen::MatrixXd K = element_stiffness(type, x, elasticity_matrix(rubber, analysis), thickness);
    const Eigen::MatrixXd expected = stiffness_of_high_order(type, x, analysis);
    EXPECT_LT((K - expected).norm(), 1e-13 * expected.norm());
  }
}

/// Translations and rotations as nodal displacements, node-major. [d nodes, d (d + 1) / 2]
Eigen::MatrixXd rigid_motions(const ElementNodes& x, Eigen::Index d) {
  Eigen::MatrixXd modes = Eigen::MatrixXd::Zero(d * x.rows(), d * (d + 1) / 2);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    Eigen::Index mode = d;
    modes.block(d * i, 0, d, d).setIdentity();
    for (Eigen::Index a = 0; a < d; ++a) {
      for (Eigen::Index b = 0; b < a; ++b, ++mode) {
        modes(d * i + a, mode) = x(i, b);
        modes(d * i + b, mode) = -x(i, a);
      }
    }
  }
  return modes;
}

TEST_P(BodyElement, StiffnessIsSymmetricAndOnlyRigidMotionsTakeNoForce) {
  const ElementType type = GetParam();
  const Eigen::Index d = traits(type).dimension, rigid = d * (d + 1) / 2;
  for (const bool curved : {false, true}) {
    const ElementNodes x = distorted(type, curved);
    for (const Analysis analysis : analyses(type)) {
      const Eigen::MatrixXd K = element_stiffness(type, x, elasticity_matrix(rubber, analysis), thickness);
      EXPECT_LT((K - K.transpose()).norm(), 1e-15 * K.norm());
      EXPECT_LT((K * rigid_motions(x, d)).norm(), 1e-14 * K.norm());
      const Eigen::VectorXd eigenvalues =  // ascending
          Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(K, Eigen::EigenvaluesOnly).eigenvalues();
      const double largest = eigenvalues[eigenvalues.size() - 1];
      EXPECT_LT(std::abs(eigenvalues[0]), 1e-14 * largest);
      EXPECT_LT(std::abs(eigenvalues[rigid - 1]), 1e-14 * largest);
      EXPECT_GT(eigenvalues[rigid], 1e-3 * largest) << "a mode without energy: hourglass";
    }
  }
}

/// Some symmetric strain as u = G x; in the plane without parts across it.
Mat3 some_gradient(ElementType type) {
  Mat3 G;
  G << 1e-3, 2e-3, -5e-4, 4e-4, -2e-3, 1e-3, 3e-4, -6e-4, 1.5e-3;
  if (traits(type).dimension == 2) G.row(2) = G.col(2).setZero().transpose();
  return G;
}

/// u = G x at the nodes, node-major. [d nodes]
Eigen::VectorXd linear_field(ElementType type, const ElementNodes& x, const Mat3& G) {
  const Eigen::Index d = traits(type).dimension;
  const Eigen::MatrixXd u = (G * x.transpose()).topRows(d);
  return u.reshaped();
}

TEST_P(BodyElement, StrainEnergyAndForcesOfALinearField) {
  const ElementType type = GetParam();
  const Mat3 G = some_gradient(type), strain = 0.5 * (G + G.transpose());
  const Shape shape = known_shape(type);
  const Eigen::VectorXd u = linear_field(type, shape.x, G);
  Eigen::VectorXd engineering(6);
  engineering << G(0, 0), G(1, 1), G(2, 2), G(0, 1) + G(1, 0), G(1, 2) + G(2, 1), G(2, 0) + G(0, 2);
  if (traits(type).dimension == 2) engineering = Vec3(engineering[0], engineering[1], engineering[3]);
  for (const QuadraturePoint& q : quadrature(type)) {
    const Eigen::VectorXd found = strain_matrix(mapped_gradients(type, shape.x, q.xi).gradients) * u;
    EXPECT_LT((found - engineering).norm(), 1e-16);
  }
  for (const Analysis analysis : analyses(type)) {
    const ElasticityMatrix D = elasticity_matrix(rubber, analysis);
    const Eigen::VectorXd Ku = element_stiffness(type, shape.x, D, thickness) * u;
    const double energy =
        thickness * shape.measure *
        (0.5 * lambda_of(analysis) * std::pow(strain.trace(), 2) + mu() * strain.squaredNorm());
    EXPECT_NEAR(0.5 * u.dot(Ku), energy, 1e-13 * energy);
    const Eigen::VectorXd force = element_stress_force(type, shape.x, D * engineering, thickness);
    EXPECT_LT((force - Ku).norm(), 1e-13 * Ku.norm());
  }
}

}  // namespace
}  // namespace palpate
