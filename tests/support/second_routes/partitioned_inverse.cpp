#include "tests/support/second_routes/partitioned_inverse.h"

#include <cblas.h>
#include <f77blas.h>

#include "base/error.h"

namespace palpate {
namespace {

using Eigen::MatrixXd;

blasint blas(Eigen::Index i) {
  return static_cast<blasint>(i);
}

/// The inverse of a symmetric positive definite matrix in place; its upper triangle is not read.
void invert(MatrixXd& A) {
  char lower = 'L';
  blasint order = blas(A.rows());
  blasint info = 0;
  dpotrf_(&lower, &order, A.data(), &order, &info);
  if (info == 0) dpotri_(&lower, &order, A.data(), &order, &info);
  if (info != 0) {
    throw Error("the stiffness of an overlay is not positive definite beside the body's",
                "invert_by_partitioning", "leave out the local dofs that the body has itself");
  }
  A.triangularView<Eigen::StrictlyUpper>() = A.transpose();
}

}  // namespace

PartitionedInverse invert_by_partitioning(const PatchStiffness& stiffness, const MatrixXd& greens) {
  const MatrixXd& K_LG = stiffness.K_LG;
  const blasint L = blas(K_LG.rows()), g = blas(K_LG.cols());
  MatrixXd psi(L, g);
  cblas_dsymm(CblasColMajor, CblasRight, CblasLower, L, g, 1.0, greens.data(), g, K_LG.data(), L, 0.0,
              psi.data(), L);
  PartitionedInverse inverse{.local = MatrixXd(stiffness.K_L), .mixed = MatrixXd(L, g), .global = greens};
  cblas_dgemm(CblasColMajor, CblasNoTrans, CblasTrans, L, L, g, -1.0, psi.data(), L, K_LG.data(), L, 1.0,
              inverse.local.data(), L);
  invert(inverse.local);
  cblas_dsymm(CblasColMajor, CblasLeft, CblasLower, L, g, -1.0, inverse.local.data(), L, psi.data(), L, 0.0,
              inverse.mixed.data(), L);
  cblas_dgemm(CblasColMajor, CblasTrans, CblasNoTrans, g, g, L, -1.0, inverse.mixed.data(), L, psi.data(), L,
              1.0, inverse.global.data(), g);
  return inverse;
}

}  // namespace palpate
