// Places of element entries in a sparse matrix, found once.
#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <span>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

using LiveMatrix = Eigen::SparseMatrix<double>;  ///< of free dofs; only its lower triangle is stored

/// The sparse matrix that elements add up to, and where each of their entries goes.
class TangentPattern {
 public:
  TangentPattern() = default;
  /// `cells` [cells * nodes_per_cell] node numbers; `free_of_dof` [d N] number among the free dofs, -1 if
  /// held.
  TangentPattern(std::span<const Index> cells, int nodes_per_cell, int dimension,
                 std::span<const Index> free_of_dof, Index free_dofs);

  /// The pattern's matrix with all entries zero.
  [[nodiscard]] const LiveMatrix& zero() const noexcept { return zero_; }
  /// Places of a cell's entries in the values: for dofs p and q <= p of the cell at p (p + 1) / 2 + q; -1 if
  /// one of them is held.
  [[nodiscard]] std::span<const Index> places(Index cell) const noexcept {
    return {places_.data() + static_cast<std::size_t>(cell) * entries_, entries_};
  }
  /// [n] places of the diagonal in the values.
  [[nodiscard]] std::span<const Index> diagonal() const noexcept { return diagonal_; }

 private:
  LiveMatrix zero_;
  std::size_t entries_ = 0;  // per cell
  std::vector<Index> places_;
  std::vector<Index> diagonal_;
};

}  // namespace palpate
