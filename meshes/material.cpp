#include "meshes/material.h"

#include <fmt/format.h>

#include <cmath>

#include "base/error.h"
#include "meshes/mesh.h"

namespace palpate {

namespace {

double lame_lambda(const Material& m) {
  return m.youngs_modulus * m.poissons_ratio / ((1.0 + m.poissons_ratio) * (1.0 - 2.0 * m.poissons_ratio));
}
double shear_modulus(const Material& m) {
  return m.youngs_modulus / (2.0 * (1.0 + m.poissons_ratio));
}

}  // namespace

ElasticityMatrix elasticity_matrix(const Material& material, Analysis analysis) {
  const double mu = shear_modulus(material);
  double lambda = lame_lambda(material);
  if (analysis == Analysis::plane_stress) lambda = 2.0 * mu * lambda / (lambda + 2.0 * mu);
  const Eigen::Index normal = analysis == Analysis::solid ? 3 : 2,
                     shear = analysis == Analysis::solid ? 3 : 1;
  ElasticityMatrix D = ElasticityMatrix::Zero(normal + shear, normal + shear);
  D.topLeftCorner(normal, normal).setConstant(lambda);
  D.diagonal().head(normal).array() += 2.0 * mu;
  D.diagonal().tail(shear).setConstant(mu);
  return D;
}

StressVector initial_stress(const Material& material, Analysis analysis) {
  const Eigen::Map<const Eigen::Matrix<double, 6, 1>> strain(material.initial_strain.data());
  if (analysis == Analysis::solid) return elasticity_matrix(material) * strain;
  const Vec3 in_plane(strain[0], strain[1], strain[3]);
  StressVector stress = elasticity_matrix(material, analysis) * in_plane;
  if (analysis == Analysis::plane_strain) stress.head(2).array() += lame_lambda(material) * strain[2];
  return stress;
}

void check_material(const Material& material, const std::string& where) {
  const double E = material.youngs_modulus, nu = material.poissons_ratio, rho = material.density;
  if (!(std::isfinite(E) && E > 0.0)) {
    throw Error(fmt::format("youngs_modulus must be positive, not {}", E), where,
                "Give Young's modulus in pascal, e.g. 5000");
  }
  if (!(nu > -1.0 && nu < 0.5)) {
    throw Error(fmt::format("poissons_ratio must be between -1 and 0.5 (both excluded), not {}", nu), where,
                "Soft tissue is 0.45 to 0.499");
  }
  if (!(std::isfinite(rho) && rho > 0.0)) {
    throw Error(fmt::format("density must be positive, not {}", rho), where, "Give it in kg/m^3, e.g. 1060");
  }
  if (!(std::isfinite(material.friction) && material.friction >= 0.0)) {
    throw Error(fmt::format("friction must be 0 or more, not {}", material.friction), where,
                "Give Coulomb's coefficient, e.g. 0.2 for wet tissue");
  }
  for (const double strain : material.initial_strain) {
    if (!std::isfinite(strain)) throw Error("initial_strain is not finite", where, "Give six numbers");
  }
}

}  // namespace palpate
