// Isotropic linear elasticity, in space and in the plane.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace palpate {

/// Kind of analysis, which determines the elasticity matrix.
enum class Analysis : std::uint8_t {
  solid,         ///< three dimensions
  plane_stress,  ///< thin sheet: no stress across it
  plane_strain,  ///< slice of a long body: no strain along it
};

/// Elasticity matrix D [6 x 6], in the plane [3 x 3].
using ElasticityMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;
/// Stress [xx yy zz xy yz zx], in the plane [xx yy xy] [Pa].
using StressVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;

/// Isotropic material; material_fields.h names each member and its range.
struct Material {
  double youngs_modulus = 0.0;  ///< E [Pa]
  double poissons_ratio = 0.0;  ///< nu [-]
  double density = 1000.0;      ///< [kg/m^3]
  double friction = 0.0;        ///< Coulomb's coefficient between its surface and a tool [-], >= 0
  /// eps_0 [xx yy zz xy yz zx], engineering shear: the strain at which the material is free of stress
  /// (swelling, thermal expansion).
  std::array<double, 6> initial_strain{};
};

/// Lame's constants lambda and mu of a body in space [Pa].
double lame_lambda(const Material& material);
double shear_modulus(const Material& material);

/// D of sigma = D (epsilon - eps_0) for engineering strain, shear gamma = 2 epsilon (theory.md section 1).
ElasticityMatrix elasticity_matrix(const Material& material, Analysis analysis = Analysis::solid);

/// D eps_0: the stress that suppresses the initial strain. In plane strain eps_0,zz counts through Poisson's
/// ratio; in plane stress it is free.
StressVector initial_stress(const Material& material, Analysis analysis = Analysis::solid);

}  // namespace palpate
