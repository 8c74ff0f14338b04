// Inversion by partitioning: the papers' way to an overlay, the reference for tests and benchmarks.
#pragma once

#include <Eigen/Core>

#include "runtime/body/overlay.h"

namespace palpate {

/// The inverse of the stiffness of body and overlay together, at the patch's nodes (theory.md section 4).
struct PartitionedInverse {
  Eigen::MatrixXd local;   ///< Xi_L [L x L]
  Eigen::MatrixXd mixed;   ///< Xi_LG [L x d g]
  Eigen::MatrixXd global;  ///< Xi_G at the patch's nodes [d g x d g]
};

/// By BLAS and LAPACK with all local dofs, which is what the condensed way of Overlay does without: with
/// `greens` the body's Xi_QQ [d g x d g] and Psi = K_LG Xi_QQ,
///   Xi_L = (K_L - Psi K_GL)^-1,  Xi_LG = -Xi_L Psi,  Xi_G = Xi_QQ - Xi_LG^T Psi.
/// Throws Error when K_L - Psi K_GL is not positive definite.
PartitionedInverse invert_by_partitioning(const PatchStiffness& stiffness, const Eigen::MatrixXd& greens);

}  // namespace palpate
