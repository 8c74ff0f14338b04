// Material law and linear tetrahedron against what elasticity says of them.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>
#include <numbers>
#include <random>

#include "meshes/generate.h"
#include "meshes/material.h"
#include "meshes/surface.h"
#include "meshes/tet4.h"
#include "tests/meshes_files.h"

namespace palpate {
namespace {

using test::contains;
using test::error_of;

constexpr Material rubber{2.0e5, 0.42, 1100.0};

tet4::Corners some_tet() {
  tet4::Corners x;
  x << 0.1, 1.3, 0.2, 0.4,  //
      -0.2, 0.1, 0.9, 0.3,  //
      0.3, 0.2, 0.35, 1.4;
  return x;
}

Mat3 some_gradient() {
  Mat3 G;
  G << 1e-3, 2e-3, -5e-4, 4e-4, -2e-3, 1e-3, 3e-4, -6e-4, 1.5e-3;
  return G;
}

Eigen::Matrix<double, 12, 1> linear_field(const tet4::Corners& x, const Mat3& G) {
  const tet4::Corners u = G * x;
  return Eigen::Map<const Eigen::Matrix<double, 12, 1>>(u.data());
}

TEST(Material, ElasticityInvertsTheCompliance) {
  const double E = rubber.youngs_modulus, nu = rubber.poissons_ratio, shear = E / (2.0 * (1.0 + nu));
  Matrix6 compliance = Matrix6::Zero();
  compliance.topLeftCorner<3, 3>().setConstant(-nu / E);
  compliance.diagonal() << 1 / E, 1 / E, 1 / E, 1 / shear, 1 / shear, 1 / shear;
  EXPECT_LT((elasticity_matrix(rubber) * compliance - Matrix6::Identity()).norm(), 1e-12);
}

TEST(Material, ConstantsOutsideTheirRangesAreRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const struct {
    Material material;
    const char* names;
  } cases[] = {
      {{0.0, 0.3, 1e3}, "youngs_modulus"}, {{-5.0, 0.3, 1e3}, "-5"},     {{nan, 0.3, 1e3}, "youngs_modulus"},
      {{inf, 0.3, 1e3}, "youngs_modulus"}, {{1e3, 0.5, 1e3}, "0.5"},     {{1e3, -1.0, 1e3}, "poissons_ratio"},
      {{1e3, nan, 1e3}, "poissons_ratio"}, {{1e3, 0.3, 0.0}, "density"}, {{1e3, 0.3, nan}, "density"},
      {{1e3, 0.3, inf}, "density"}};
  for (const auto& bad : cases) {
    const Error error = error_of([&] { check_material(bad.material, "model.toml:7"); });
    EXPECT_TRUE(contains(error.what(), bad.names)) << error.what();
    EXPECT_EQ(error.where(), "model.toml:7");
    EXPECT_FALSE(error.hint().empty());
  }
  EXPECT_NO_THROW(check_material({1e3, 0.4999, 1e3}, ""));
  EXPECT_NO_THROW(check_material({1e3, -0.9, 1e3}, ""));
}

TEST(Tet4, VolumeOfTheRegularTetrahedron) {
  tet4::Corners x;  // alternate corners of a cube of edge 1: edge sqrt(2)
  x << 0, 1, 1, 0, 0, 1, 0, 1, 0, 0, 1, 1;
  const double edge = std::numbers::sqrt2;
  EXPECT_NEAR(std::abs(tet4::volume(x)), edge * edge * edge / (6.0 * std::numbers::sqrt2), 1e-15);
  const double sign = tet4::volume(x);
  x.col(2).swap(x.col(3));
  EXPECT_DOUBLE_EQ(tet4::volume(x), -sign);
}

TEST(Tet4, ShapeFunctionsArePartitionOfUnityAndOneAtTheirCorner) {
  const tet4::Corners x = some_tet();
  const tet4::Gradients g = tet4::gradients(x);
  EXPECT_LT(g.colwise().sum().norm(), 1e-14);
  for (Eigen::Index i = 0; i < 4; ++i) {
    for (Eigen::Index j = 0; j < 4; ++j) {  // N_i falls from 1 to 0 along the edge to j
      EXPECT_NEAR(g.row(i).dot((x.col(j) - x.col(i)).transpose()), i == j ? 0.0 : -1.0, 1e-14);
    }
  }
}

TEST(Tet4, StrainOfALinearField) {
  const tet4::Corners x = some_tet();
  const Mat3 G = some_gradient();
  Eigen::Matrix<double, 6, 1> strain;
  strain << G(0, 0), G(1, 1), G(2, 2), G(0, 1) + G(1, 0), G(1, 2) + G(2, 1), G(2, 0) + G(0, 2);
  EXPECT_LT((tet4::strain_matrix(tet4::gradients(x)) * linear_field(x, G) - strain).norm(), 1e-16);
}

TEST(Tet4, EnergyOfALinearField) {
  const tet4::Corners x = some_tet();
  const Mat3 G = some_gradient(), strain = 0.5 * (G + G.transpose());
  const double E = rubber.youngs_modulus, nu = rubber.poissons_ratio;
  const double lambda = E * nu / ((1 + nu) * (1 - 2 * nu)), mu = E / (2 * (1 + nu));
  const double energy =
      tet4::volume(x) * (0.5 * lambda * std::pow(strain.trace(), 2) + mu * strain.squaredNorm());
  const auto u = linear_field(x, G);
  const tet4::Stiffness K = tet4::stiffness(x, elasticity_matrix(rubber));
  EXPECT_NEAR(0.5 * u.dot(K * u), energy, 1e-12 * energy);
}

TEST(Tet4, StiffnessIsSymmetricAndHasOnlyTheSixRigidMotionsInItsNullSpace) {
  const tet4::Corners x = some_tet();
  const Eigen::MatrixXd K = tet4::stiffness(x, elasticity_matrix(rubber));
  EXPECT_LT((K - K.transpose()).norm(), 1e-13 * K.norm());
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const tet4::Corners translation = Vec3::Unit(axis).replicate<1, 4>();
    EXPECT_LT((K * translation.reshaped()).norm(), 1e-13 * K.norm());
    tet4::Corners rotation;
    for (Eigen::Index i = 0; i < 4; ++i) rotation.col(i) = Vec3::Unit(axis).cross(Vec3(x.col(i)));
    EXPECT_LT((K * rotation.reshaped()).norm(), 1e-13 * K.norm());
  }
  const Eigen::VectorXd eigenvalues = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(K).eigenvalues();
  EXPECT_GT(eigenvalues[0], -1e-12 * eigenvalues[11]);  // ascending
  EXPECT_LT(eigenvalues[5], 1e-12 * eigenvalues[11]);
  EXPECT_GT(eigenvalues[6], 1e-3 * eigenvalues[11]);
}

TEST(Tet4, PatchTestOnADistortedMesh) {
  Mesh mesh = generate(BoxShape{Vec3(-0.1, 0.0, 0.2), Vec3(0.3, 0.2, 0.25), {4, 3, 4}});
  std::vector<bool> interior(mesh.nodes.size(), true);
  for (const Index node : extract_surface(mesh).nodes) interior[static_cast<std::size_t>(node)] = false;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> shift(-0.01, 0.01);
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    if (interior[node]) mesh.nodes[node] += Vec3(shift(random), shift(random), shift(random));
  }
  const Matrix6 D = elasticity_matrix(rubber);
  std::vector<Vec3> force(mesh.nodes.size(), Vec3::Zero());
  for (const Tet& tet : mesh.tets) {
    const tet4::Corners x = tet4::corners(mesh, tet);
    ASSERT_GT(tet4::volume(x), 0.0);
    const Eigen::Matrix<double, 12, 1> f = tet4::stiffness(x, D) * linear_field(x, some_gradient());
    for (std::size_t i = 0; i < 4; ++i) {
      force[static_cast<std::size_t>(tet[i])] += f.segment<3>(static_cast<Eigen::Index>(3 * i));
    }
  }
  double largest = 0.0, largest_inside = 0.0;
  std::size_t inside = 0;
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    largest = std::max(largest, force[node].norm());
    if (!interior[node]) continue;
    ++inside;
    largest_inside = std::max(largest_inside, force[node].norm());
  }
  EXPECT_EQ(inside, 3u * 2u * 3u);
  EXPECT_GT(largest, 0.0);
  EXPECT_LT(largest_inside, 1e-12 * largest);
}

}  // namespace
}  // namespace palpate
