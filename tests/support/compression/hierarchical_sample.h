// Matrices in nested low-rank form made by hand, and what their definition says of every entry.
#pragma once

#include <Eigen/Core>
#include <random>

#include "matrices/hierarchical.h"

namespace palpate::test {

/// What a random matrix is like.
struct HierarchicalKind {
  int dimension = 3;
  Index nodes = 1;
  int levels = 0;
  Index largest_rank = 6;  ///< ranks are random from 0 to it; clusters without a far pair above have 0
  double scale = 1.0;
};

/// In [-1, 1), the same on every machine.
double random_number(std::mt19937_64& random);

/// Ranks, pairs and entries at random, the same for the same seed: far pairs are on all levels but the first,
/// and a pair of leaves is near for no reason but chance.
HierarchicalMatrix random_hierarchical(const HierarchicalKind& kind, unsigned seed);

/// All entries by the definition: V of every cluster is written out. The lower triangle of blocks is
/// mirrored, and NaN is where no pair says anything.
Eigen::MatrixXd written_out(const HierarchicalMatrix& matrix);

}  // namespace palpate::test
