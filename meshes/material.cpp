#include "meshes/material.h"

#include <fmt/format.h>

#include <cmath>

#include "meshes/error.h"

namespace palpate {

Matrix6 elasticity_matrix(const Material& material) {
  const double E = material.youngs_modulus, nu = material.poissons_ratio;
  const double lambda = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
  const double mu = E / (2.0 * (1.0 + nu));
  Matrix6 D = Matrix6::Zero();
  D.topLeftCorner<3, 3>().setConstant(lambda);
  D.diagonal().head<3>().array() += 2.0 * mu;
  D.diagonal().tail<3>().setConstant(mu);
  return D;
}

void check_material(const Material& material, const std::string& where) {
  const double E = material.youngs_modulus, nu = material.poissons_ratio, rho = material.density;
  if (!(std::isfinite(E) && E > 0.0)) {
    throw Error(fmt::format("youngs_modulus must be positive, not {}", E), where,
                "Give Young's modulus in pascal, e.g. 5000.");
  }
  if (!(nu > -1.0 && nu < 0.5)) {
    throw Error(fmt::format("poissons_ratio must be between -1 and 0.5 (both excluded), not {}", nu), where,
                "Soft tissue is 0.45 to 0.499.");
  }
  if (!(std::isfinite(rho) && rho > 0.0)) {
    throw Error(fmt::format("density must be positive, not {}", rho), where, "Give it in kg/m^3, e.g. 1060.");
  }
}

}  // namespace palpate
