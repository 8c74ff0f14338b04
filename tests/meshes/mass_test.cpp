// Element mass against integrals of high order and the mechanics of rigid bodies.
#include <gtest/gtest.h>

#include "tests/support/bodies/meshes_elements.h"
#include "tests/support/second_routes/dense_algebra.h"

namespace palpate::mass_test {
namespace {

using namespace test;

constexpr double density = 1060.0;

/// In space an element has no thickness of its own.
double thickness(ElementType type) {
  return traits(type).dimension == 2 ? 0.013 : 1.0;
}

/// Simplices with straight edges, parallelograms and parallelepipeds: where the rule is exact.
ElementNodes affine(ElementType type) {
  return is_simplex(type) ? distorted(type) : mapped(type, vtk_nodes(type));
}

class ElementMasses : public testing::TestWithParam<ElementType> {};
INSTANTIATE_TEST_SUITE_P(Kinds, ElementMasses, testing::ValuesIn(body_elements), name_of);

TEST_P(ElementMasses, AreTheIntegralsOnAffineElements) {
  const ElementType type = GetParam();
  const ElementNodes x = affine(type);
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(x.rows(), x.rows());
  for (const QuadraturePoint& q : gauss_rule(type, 5)) {
    const Eigen::VectorXd N = shape_functions(type, q.xi);
    expected += density * thickness(type) * q.weight * mapped_gradients(type, x, q.xi).determinant * N *
                N.transpose();
  }
  const Eigen::MatrixXd M = element_mass(type, x, density, thickness(type));
  EXPECT_LT((M - expected).norm(), 1e-14 * expected.norm());
}

TEST_P(ElementMasses, AddUpToTheElements) {
  const ElementType type = GetParam();
  const Shape shape = known_shape(type);
  const double mass = density * thickness(type) * shape.measure;
  const Eigen::MatrixXd M = element_mass(type, shape.x, density, thickness(type));
  const Eigen::VectorXd lumped = element_lumped_mass(type, shape.x, density, thickness(type));
  EXPECT_NEAR(M.sum() / mass, 1.0, 1e-14);
  EXPECT_NEAR(lumped.sum() / mass, 1.0, 1e-14);
  EXPECT_GT(lumped.minCoeff(), 0.0);
}

TEST_P(ElementMasses, ArePositiveDefiniteAndSymmetric) {
  const ElementType type = GetParam();
  const Eigen::MatrixXd M = element_mass(type, distorted(type, true), density, thickness(type));
  EXPECT_EQ(M, Eigen::MatrixXd(M.transpose()));
  const Eigen::VectorXd eigenvalues = test::eigenvalues_of(M);
  EXPECT_GT(eigenvalues[0], 1e-3 * eigenvalues[eigenvalues.size() - 1]);
}

/// Integral of x x^T: of a simplex by its corners, of a parallelepiped by its edges.
Mat3 second_moments(ElementType type, const ElementNodes& x, double measure) {
  const int d = traits(type).dimension;
  if (is_simplex(type)) {
    const Eigen::MatrixXd corners = x.topRows(d + 1);
    const Vec3 sum = corners.colwise().sum();
    return measure / ((d + 1) * (d + 2)) * (corners.transpose() * corners + sum * sum.transpose());
  }
  const Vec3 center = x.colwise().mean();
  Mat3 moments = center * center.transpose();
  for (const Eigen::Index end :
       d == 2 ? std::vector<Eigen::Index>{1, 3} : std::vector<Eigen::Index>{1, 3, 4}) {
    const Vec3 edge = x.row(end) - x.row(0);
    moments += edge * edge.transpose() / 12.0;
  }
  return measure * moments;
}

/// 1/2 integral of density |v + w x x|^2.
TEST_P(ElementMasses, GiveARigidMotionItsKineticEnergy) {
  const ElementType type = GetParam();
  const bool plane = traits(type).dimension == 2;
  const ElementNodes x = affine(type);
  const double measure = element_volume(type, x);  // against geometry: AddUpToTheElements
  const Vec3 v = plane ? Vec3(0.3, -0.2, 0.0) : Vec3(0.3, -0.2, 0.5);
  const Vec3 w = plane ? Vec3(0.0, 0.0, 7.0) : Vec3(4.0, -3.0, 7.0);
  const Mat3 moments = second_moments(type, x, measure);
  const Eigen::VectorXd shares = element_shape_integrals(type, x, 1.0);
  const Vec3 first = x.transpose() * shares;  // integral of x
  const double expected = 0.5 * density * thickness(type) *
                          (measure * v.squaredNorm() + 2.0 * v.dot(w.cross(first)) +
                           w.squaredNorm() * moments.trace() - w.dot(moments * w));
  Eigen::MatrixXd velocity(x.rows(), 3);
  for (Eigen::Index i = 0; i < x.rows(); ++i) velocity.row(i) = v + w.cross(Vec3(x.row(i)));
  const Eigen::MatrixXd M = element_mass(type, x, density, thickness(type));
  EXPECT_NEAR(0.5 * (velocity.transpose() * M * velocity).trace() / expected, 1.0, 1e-13);
}

}  // namespace
}  // namespace palpate::mass_test
