// Shape functions, their gradients and element integrals against what interpolation and geometry say.
#include "meshes/element.h"

#include <gtest/gtest.h>

#include "tests/support/bodies/meshes_elements.h"

namespace palpate::element_test {
namespace {

using namespace test;

constexpr double thickness = 0.013;

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
  Eigen::VectorXd gradient(3);
  gradient << 1.5, -2.0, d == 3 ? 0.7 : 0.0;
  for (const bool curved : {false, true}) {
    const ElementNodes x = distorted(type, curved);
    const Eigen::VectorXd u = (x * gradient).array() + 0.3;
    for (const Vec3& xi : inner_points(type)) {
      const Eigen::VectorXd N = shape_functions(type, xi);
      const Vec3 place = x.transpose() * N;
      EXPECT_NEAR(N.dot(u), gradient.dot(place) + 0.3, 1e-14);
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
        const Eigen::VectorXd N = shape_functions(type, xi);
        const Vec3 place = x.transpose() * N;
        Eigen::VectorXd gradient = Eigen::VectorXd::Zero(d);
        gradient[i] += place[j];
        gradient[j] += place[i];
        const Eigen::VectorXd found = mapped_gradients(type, x, xi).gradients.transpose() * u;
        error = std::max(error, std::abs(N.dot(u) - place[i] * place[j]) / size / size);
        error = std::max(error, (found - gradient).norm() / size);
      }
    }
  }
  if (quadratic) {
    EXPECT_LT(error, 1e-13);
  } else {
    EXPECT_GT(error, 0.1);
  }
}

/// 1 - x - y - z, x, y, z.
Eigen::VectorXd barycentric(const Vec3& xi, Eigen::Index d) {
  Eigen::VectorXd L(d + 1);
  L[0] = 1.0 - xi.sum();
  for (Eigen::Index k = 0; k < d; ++k) L[k + 1] = xi[k];
  return L;
}

TEST_P(SimplexElement, GradientsInSpaceAreTheClosedForm) {
  const ElementType type = GetParam();
  const Eigen::Index d = traits(type).dimension;
  const ElementNodes x = distorted(type);
  const Eigen::MatrixXd dL = barycentric_gradients(x, d);
  const std::vector<Vec3> reference = vtk_nodes(type);
  for (const Vec3& xi : inner_points(type)) {
    const Eigen::VectorXd L = barycentric(xi, d);
    Eigen::MatrixXd expected = dL;
    if (traits(type).nodes > d + 1) {
      expected.resize(traits(type).nodes, d);
      for (Eigen::Index i = 0; i <= d; ++i) expected.row(i) = (4.0 * L[i] - 1.0) * dL.row(i);
      for (Eigen::Index i = d + 1; i < expected.rows(); ++i) {  // N = 4 L_a L_b in the middle of a and b
        const Eigen::VectorXd middle = barycentric(reference[static_cast<std::size_t>(i)], d);
        Eigen::Index a = 0, b = d;
        while (middle[a] == 0.0) ++a;
        while (middle[b] == 0.0) --b;
        expected.row(i) = 4.0 * (L[a] * dL.row(b) + L[b] * dL.row(a));
      }
    }
    const Eigen::MatrixXd found = mapped_gradients(type, x, xi).gradients;
    EXPECT_LT((found - expected).norm(), 1e-13 * expected.norm());
  }
}

// --- measures and loads ---

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

}  // namespace
}  // namespace palpate::element_test
