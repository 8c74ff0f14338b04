// Reduction of the ranks of a matrix in nested low-rank form.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "matrices/hierarchical.h"
#include "precompute/numerics/sharing.h"

namespace palpate {

/// A matrix with bases of minimal rank (Börm, Efficient Numerical Methods for Non-local Operators, EMS 2010,
/// chapters 5 and 6), and the pair_error of the change. With L the Cholesky factors of the leaves, directions
/// of a cluster are dropped as long as L^-1 u changes by at most `cut` (root mean square) in every entry, for
/// random loads L^-T (+-1) on everything far. Errors are thus weighted by the forces that they cause: a touch
/// of the whole leaf responds to displacements u with forces L^-T L^-1 u. The near pairs are common to both
/// matrices. Nullopt if stopped. Throws OutOfReach if a rank exceeds most_rank.
std::optional<HierarchicalMatrix> recompressed(const HierarchicalMatrix& matrix, double cut,
                                               Sharing& sharing);

/// Cholesky factor L of the block of Xi between the dofs of a leaf [0, leaves), L L^T; rows of the identity
/// where held. Throws OutOfReach if rounding has made the block indefinite.
Eigen::MatrixXd root_of_leaf(const HierarchicalMatrix& matrix, Index leaf);

/// Square root of the diagonal [order], from the near pairs; 0 where held.
std::vector<double> root_of_diagonal(const HierarchicalMatrix& matrix);

}  // namespace palpate
