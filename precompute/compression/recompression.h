// Fewer terms for a matrix in nested low-rank form.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "matrices/hierarchical.h"
#include "precompute/numerics/sharing.h"

namespace palpate {

/// A matrix with bases of the least ranks (Börm, Efficient Numerical Methods for Non-local Operators, EMS
/// 2010, chapters 5 and 6), and pair_error of what that changes. With L the roots of the leaves, of each
/// cluster those directions are dropped without which L^-1 u by random loads L^-T (+-1) on all that is far
/// has no entry that is off by more than `cut` (root mean square). So errors are weighed by what forces they
/// make: a touch of the whole leaf answers displacements u with forces L^-T L^-1 u. Shares the near pairs.
/// Nothing where it was stopped. Throws OutOfReach where a rank would be above most_rank.
std::optional<HierarchicalMatrix> recompressed(const HierarchicalMatrix& matrix, double cut,
                                               Sharing& sharing);

/// L of the block of Xi between the dofs of a leaf [0, leaves), L L^T; rows of the identity where held.
/// Throws OutOfReach where rounding has made the block indefinite.
Eigen::MatrixXd root_of_leaf(const HierarchicalMatrix& matrix, Index leaf);

/// The root of the diagonal [order], from the near pairs; 0 where held.
std::vector<double> root_of_diagonal(const HierarchicalMatrix& matrix);

}  // namespace palpate
