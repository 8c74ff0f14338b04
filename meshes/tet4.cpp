#include "meshes/tet4.h"

#include <Eigen/LU>

namespace palpate::tet4 {
namespace {

/// Columns are the edges from corner 0: dx/dxi of the linear map from the unit tetrahedron.
Mat3 jacobian(const Corners& x) {
  return x.rightCols<3>().colwise() - x.col(0);
}

}  // namespace

Corners corners(const Mesh& mesh, const Tet& tet) {
  Corners x;
  for (std::size_t i = 0; i < 4; ++i)
    x.col(static_cast<Eigen::Index>(i)) = mesh.nodes[static_cast<std::size_t>(tet[i])];
  return x;
}

double volume(const Corners& x) {
  return jacobian(x).determinant() / 6.0;
}

Gradients gradients(const Corners& x) {
  Gradients g;
  g.bottomRows<3>() = jacobian(x).inverse();
  g.row(0) = -g.bottomRows<3>().colwise().sum();
  return g;
}

StrainMatrix strain_matrix(const Gradients& g) {
  StrainMatrix B = StrainMatrix::Zero();
  for (Eigen::Index i = 0; i < 4; ++i) {
    const double x = g(i, 0), y = g(i, 1), z = g(i, 2);
    B.middleCols<3>(3 * i) << x, 0, 0,  //
        0, y, 0,                        //
        0, 0, z,                        //
        y, x, 0,                        //
        0, z, y,                        //
        z, 0, x;
  }
  return B;
}

Stiffness stiffness(const Corners& x, const Matrix6& D) {
  const StrainMatrix B = strain_matrix(gradients(x));
  return volume(x) * B.transpose() * D * B;
}

}  // namespace palpate::tet4
