// Fewer terms for a matrix in nested low-rank form.
#pragma once

#include "matrices/hierarchical.h"

namespace palpate {

/// A matrix with orthonormal bases of the least ranks (Börm, Efficient Numerical Methods for Non-local
/// Operators, EMS 2010, chapters 5 and 6): of each cluster those directions are dropped without which random
/// loads of +-1 on all that is far move none of its dofs by more than `cut` less (root mean square), in units
/// of the root of D, the diagonal. Shares the near pairs.
HierarchicalMatrix recompressed(const HierarchicalMatrix& matrix, double cut, int jobs);

/// The root of the diagonal [order], from the near pairs; 0 where held.
std::vector<double> root_of_diagonal(const HierarchicalMatrix& matrix);

}  // namespace palpate
