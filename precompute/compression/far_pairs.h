// The far pairs of a compression: skeletons of clusters, and the couplings between them.
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "matrices/hierarchical.h"
#include "precompute/compression/selected_solver.h"
#include "precompute/numerics/sharing.h"

namespace palpate {

using DoubleRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Stored dofs of a cluster: [first_dof, end_dof).
inline std::int64_t first_dof(const HierarchicalMatrix& matrix, Index cluster) noexcept {
  return std::int64_t{matrix.dimension} * matrix.tree.begin(cluster);
}
inline std::int64_t end_dof(const HierarchicalMatrix& matrix, Index cluster) noexcept {
  return std::int64_t{matrix.dimension} * matrix.tree.end(cluster);
}

/// Leaves, as clusters, that are near a leaf, and the numbers of the pairs.
std::span<const HierarchicalMatrix::Pair> neighbours(const HierarchicalMatrix& matrix, Index leaf);

/// Far partners of a cluster, and the numbers of the pairs.
std::span<const HierarchicalMatrix::Pair> partners(const HierarchicalMatrix& matrix, Index c);

/// Displacements of a leaf by loads [dofs x loads] on it and on the leaves near it.
DoubleRows near_displacement(const HierarchicalMatrix& matrix, Index leaf, const DoubleRows& loads);

/// Number of random loads, which act on the whole body.
inline constexpr Index random_loads = 256;

/// Data from which far pairs are found.
struct FarSource {
  const SelectedSolver& solver;
  bool single;                                ///< couplings are solved for in single precision
  std::int64_t forward_bytes;                 ///< memory for forward solutions
  std::span<const std::int64_t> stored_dofs;  ///< [d N] of K, -1 where held
  const HierarchicalMatrix& frame;            ///< tree and pairs, with the near ones
  const Eigen::VectorXd& root;                ///< [d N] of the diagonal, 0 where held
  const DoubleRows &load, &response;          ///< [d N x at least random_loads]
};

/// The matrix with bases and couplings of rows that are cut off by `cut`. `done` receives the fraction
/// (0..1). Nothing where it or the sharing said stop. Throws OutOfReach where a rank would be above what the
/// samples can resolve.
std::optional<HierarchicalMatrix> with_far_pairs(const FarSource& source, double cut, Sharing& sharing,
                                                 const std::function<bool(double)>& done);

}  // namespace palpate
