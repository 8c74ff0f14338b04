// Element stiffness against closed forms, integrals of high order and what elasticity says of it.
#include <gtest/gtest.h>

#include "tests/support/bodies/meshes_elements.h"
#include "tests/support/second_routes/dense_algebra.h"

namespace palpate::stiffness_test {
namespace {

using namespace test;

const Material rubber{2.0e5, 0.42, 1100.0};
constexpr double thickness = 0.013;

class ElementStiffness : public testing::TestWithParam<ElementType> {};
INSTANTIATE_TEST_SUITE_P(Kinds, ElementStiffness, testing::ValuesIn(body_elements), name_of);

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

TEST(LinearSimplexStiffness, IsTheClosedForm) {
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

TEST_P(ElementStiffness, IsTheIntegralOnAffineElements) {
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

TEST_P(ElementStiffness, IsSymmetricAndOnlyRigidMotionsTakeNoForce) {
  const ElementType type = GetParam();
  const Eigen::Index d = traits(type).dimension, rigid = d * (d + 1) / 2;
  for (const bool curved : {false, true}) {
    const ElementNodes x = distorted(type, curved);
    for (const Analysis analysis : analyses(type)) {
      const Eigen::MatrixXd K = element_stiffness(type, x, elasticity_matrix(rubber, analysis), thickness);
      EXPECT_LT((K - K.transpose()).norm(), 1e-15 * K.norm());
      EXPECT_LT((K * rigid_motions(x, d)).norm(), 1e-14 * K.norm());
      const Eigen::VectorXd eigenvalues =  // ascending
          test::eigenvalues_of(K);
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

TEST_P(ElementStiffness, StrainEnergyAndForcesOfALinearField) {
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
    const Eigen::VectorXd K_u = element_stiffness(type, shape.x, D, thickness) * u;
    const double energy =
        thickness * shape.measure *
        (0.5 * lambda_of(analysis) * std::pow(strain.trace(), 2) + mu() * strain.squaredNorm());
    EXPECT_NEAR(0.5 * u.dot(K_u), energy, 1e-13 * energy);
    const Eigen::VectorXd force = element_stress_force(type, shape.x, D * engineering, thickness);
    EXPECT_LT((force - K_u).norm(), 1e-13 * K_u.norm());
  }
}

}  // namespace
}  // namespace palpate::stiffness_test
