// Isotropic linear elasticity.
#pragma once

#include <Eigen/Core>
#include <string>

namespace palpate {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Isotropic material. Valid for E > 0, -1 < nu < 1/2, density > 0.
struct Material {
  double youngs_modulus = 0.0;  ///< E [Pa]
  double poissons_ratio = 0.0;  ///< nu [-]
  double density = 1000.0;      ///< [kg/m^3]
};

/// D of sigma = D epsilon for engineering strain [xx yy zz xy yz zx] with shear gamma = 2 epsilon (theory.md
/// section 1).
Matrix6 elasticity_matrix(const Material& material);

/// Throws Error (where = `where`) unless the constants are finite and in the valid ranges.
void check_material(const Material& material, const std::string& where);

}  // namespace palpate
