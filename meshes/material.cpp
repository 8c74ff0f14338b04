#include "meshes/material.h"

#include "meshes/mesh.h"

namespace palpate {

double lame_lambda(const Material& m) {
  return m.youngs_modulus * m.poissons_ratio / ((1.0 + m.poissons_ratio) * (1.0 - 2.0 * m.poissons_ratio));
}

double shear_modulus(const Material& m) {
  return m.youngs_modulus / (2.0 * (1.0 + m.poissons_ratio));
}

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

}  // namespace palpate
