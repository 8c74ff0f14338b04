// Material law against what elasticity says of it, in space and in the plane.
#include "meshes/material.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cstddef>
#include <limits>

#include "meshes/material_fields.h"

namespace palpate::material_test {
namespace {

const Material rubber{2.0e5, 0.42, 1100.0};
const double E = rubber.youngs_modulus, nu = rubber.poissons_ratio, G = E / (2.0 * (1.0 + nu));

/// Rows and columns xx, yy, xy of [xx yy zz xy yz zx].
constexpr std::array<Eigen::Index, 3> in_plane = {0, 1, 3};

TEST(Material, ElasticityInvertsTheCompliance) {
  Eigen::MatrixXd compliance = Eigen::MatrixXd::Zero(6, 6);
  compliance.topLeftCorner(3, 3).setConstant(-nu / E);
  compliance.diagonal() << 1 / E, 1 / E, 1 / E, 1 / G, 1 / G, 1 / G;
  const Eigen::MatrixXd D = elasticity_matrix(rubber);
  EXPECT_LT((D * compliance - Eigen::MatrixXd::Identity(6, 6)).norm(), 1e-12);
}

TEST(Material, PlaneStressHasTheInPlaneCompliance) {
  Eigen::MatrixXd compliance(3, 3);  // uniaxial stress strains by 1/E along, by -nu/E across
  compliance << 1 / E, -nu / E, 0, -nu / E, 1 / E, 0, 0, 0, 1 / G;
  const Eigen::MatrixXd D = elasticity_matrix(rubber, Analysis::plane_stress);
  EXPECT_LT((D * compliance - Eigen::MatrixXd::Identity(3, 3)).norm(), 1e-12);
}

TEST(Material, PlaneStrainIsTheSolidWithoutStrainAcross) {
  const Eigen::MatrixXd solid = elasticity_matrix(rubber);
  const Eigen::MatrixXd D = elasticity_matrix(rubber, Analysis::plane_strain);
  EXPECT_LT((D - solid(in_plane, in_plane)).norm(), 1e-15 * D.norm());
  EXPECT_NEAR(1.0 / D.inverse()(0, 0), E / (1.0 - nu * nu), 1e-10 * E);  // the plane-strain modulus
}

TEST(Material, InitialStressOfASwellingThatIsKeptAway) {
  Material swollen = rubber;
  const double strain = 0.02;
  swollen.initial_strain = {strain, strain, strain, 0, 0, 0};
  const Eigen::VectorXd solid = initial_stress(swollen);
  EXPECT_LT((solid.head(3).array() - E * strain / (1.0 - 2.0 * nu)).abs().maxCoeff(), 1e-12 * E);
  EXPECT_EQ(solid.tail(3).norm(), 0.0);
  const Eigen::VectorXd sheet = initial_stress(swollen, Analysis::plane_stress);
  EXPECT_LT((sheet.head(2).array() - E * strain / (1.0 - nu)).abs().maxCoeff(), 1e-12 * E);
  EXPECT_EQ(sheet[2], 0.0);
  const Eigen::VectorXd slice = initial_stress(swollen, Analysis::plane_strain);
  EXPECT_LT((slice - solid(in_plane)).norm(), 1e-12 * E);
}

TEST(Material, InitialStressOfAnyInitialStrain) {
  Material grown = rubber;
  grown.initial_strain = {0.01, -0.02, 0.03, 0.004, 0.005, -0.006};
  Eigen::Matrix3d strain;
  strain << 0.01, 0.002, -0.003, 0.002, -0.02, 0.0025, -0.003, 0.0025, 0.03;
  const double lambda = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
  const Eigen::Matrix3d sigma = lambda * strain.trace() * Eigen::Matrix3d::Identity() + 2.0 * G * strain;
  Eigen::VectorXd expected(6);
  expected << sigma(0, 0), sigma(1, 1), sigma(2, 2), sigma(0, 1), sigma(1, 2), sigma(2, 0);
  const Eigen::VectorXd solid = initial_stress(grown);
  EXPECT_LT((solid - expected).norm(), 1e-13 * E);
  const Eigen::VectorXd slice = initial_stress(grown, Analysis::plane_strain);
  EXPECT_LT((slice - expected(in_plane)).norm(), 1e-13 * E);
  // Plane stress: the strain across adjusts itself until sigma_zz = 0.
  const double across = 0.03 - sigma(2, 2) / (lambda + 2.0 * G);
  strain(2, 2) = across;
  const Eigen::Matrix3d relaxed = lambda * strain.trace() * Eigen::Matrix3d::Identity() + 2.0 * G * strain;
  const Eigen::VectorXd sheet = initial_stress(grown, Analysis::plane_stress);
  EXPECT_LT((sheet - Eigen::Vector3d(relaxed(0, 0), relaxed(1, 1), relaxed(0, 1))).norm(), 1e-13 * E);
}

TEST(Material, OneConstantIsOutOfItsRange) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const struct {
    Material material;
    const char* names;
  } cases[] = {
      {{0.0, 0.3, 1e3}, "youngs_modulus"},  {{-5.0, 0.3, 1e3}, "youngs_modulus"},
      {{nan, 0.3, 1e3}, "youngs_modulus"},  {{inf, 0.3, 1e3}, "youngs_modulus"},
      {{1e3, 0.5, 1e3}, "poissons_ratio"},  {{1e3, -1.0, 1e3}, "poissons_ratio"},
      {{1e3, nan, 1e3}, "poissons_ratio"},  {{1e3, 0.3, 0.0}, "density"},
      {{1e3, 0.3, nan}, "density"},         {{1e3, 0.3, inf}, "density"},
      {{1e3, 0.3, 1e3, -0.25}, "friction"}, {{1e3, 0.3, 1e3, nan}, "friction"},
      {{1e3, 0.3, 1e3, inf}, "friction"},   {{1e3, 0.3, 1e3, 0.0, {0, 0, 0, nan, 0, 0}}, "initial_strain"}};
  const auto out_of_range = [](const Material& material) {
    std::string keys;
    for_each_material_field(material, [&](const MaterialField& field, std::span<const double> values) {
      if (!std::ranges::all_of(values, [&](double value) { return field.range.contains(value); }))
        keys += field.key;
    });
    return keys;
  };
  for (const auto& bad : cases) EXPECT_EQ(out_of_range(bad.material), bad.names);
  EXPECT_EQ(out_of_range({1e3, 0.4999, 1e3}), "");
  EXPECT_EQ(out_of_range({1e3, -0.9, 1e3}), "");
  EXPECT_EQ(out_of_range({1e3, 0.3, 1e3, 1.5}), "");
}

// Members are numbers only, so what is visited must fill the struct.
TEST(MaterialFields, AreAllMembersInTheirPlaces) {
  const Material material;
  const auto* next = reinterpret_cast<const std::byte*>(&material);
  for_each_material_field(material, [&](const MaterialField& field, std::span<const double> values) {
    const auto bytes = std::as_bytes(values);
    EXPECT_EQ(bytes.data(), next) << field.key;
    next = bytes.data() + bytes.size();
  });
  EXPECT_EQ(next, reinterpret_cast<const std::byte*>(&material + 1)) << "a member is not in the table";
}

TEST(MaterialFields, SayWhatToGive) {
  for_each_material_field(Material{},
                          [](const MaterialField& field, auto) { EXPECT_FALSE(field.hint.empty()); });
}

}  // namespace
}  // namespace palpate::material_test
