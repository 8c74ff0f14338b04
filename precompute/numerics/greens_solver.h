// Columns of Xi = K^-1 for the stored dofs, from a supernodal Cholesky factor.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/numerics/factor.h"
#include "precompute/numerics/supernodal_sweeps.h"

namespace palpate {

/// Computes blocks of columns of the lower triangle of Xi restricted to the stored dofs, which are numbered
/// by their position in the elimination order. For a block whose first column is at position p
///
///   forward   L Y = E    visits only the supernodes on the paths of the elimination tree from the
///                        block's dofs to the root,
///   backward  L^T X = Y  visits only supernodes at or after p (rows above the diagonal are another
///                        block's columns) that hold a stored dof or have one below them.
///
/// In both, supernode s works only on the columns whose position is not after it. Const: any number of
/// threads may compute blocks.
class GreensSolver {
 public:
  using Workspace = SupernodalSweeps<double>::Workspace;  ///< scratch of one thread

  /// `factor` may be only analysed as long as only sizes and costs are queried. `stored` [n] marks the dofs
  /// of K whose rows and columns are requested, all or none of a node; `mesh_dofs` [n] are their dofs of the
  /// mesh, `d` node + axis. Nodes are stored whole: an axis along which a node is held has no dof in K, and
  /// its row and column are zero.
  GreensSolver(const Factor& factor, const std::vector<std::uint8_t>& stored,
               std::span<const std::int64_t> mesh_dofs, int d);

  [[nodiscard]] const Factor& factor() const noexcept { return sweeps_.factor(); }

  /// Number of stored dofs, including held ones of stored nodes.
  [[nodiscard]] std::int64_t order() const noexcept { return static_cast<std::int64_t>(place_.size()); }

  /// Dof of K of each stored dof, in the order of the columns; -1 if held.
  [[nodiscard]] std::vector<std::int64_t> stored_dofs() const;

  /// Computes columns [first, first + count) of the lower triangle, one after the other, each from its
  /// diagonal down, to `packed` (resized).
  void columns(std::int64_t first, std::int64_t count, Workspace& workspace,
               std::vector<double>& packed) const;

  /// Multiplications and additions of `columns(first, count)`.
  [[nodiscard]] double flops(std::int64_t first, std::int64_t count) const;

  /// Size of one thread's workspace for blocks of `width` columns [byte].
  [[nodiscard]] std::int64_t workspace_bytes(std::int64_t width) const;

 private:
  /// Free dofs among the stored dofs [first, first + count): a range of positions_.
  [[nodiscard]] std::span<const std::int64_t> free_positions(std::int64_t first, std::int64_t count) const;
  void mark_paths(std::span<const std::int64_t> block, std::vector<std::uint8_t>& on_path) const;
  [[nodiscard]] bool needed(std::size_t supernode, std::int64_t first_position) const noexcept;

  SupernodalSweeps<double> sweeps_;
  std::vector<std::int64_t> last_stored_;  // [supernodes] largest stored position <= its last column, or -1
  std::vector<std::int64_t> positions_;    // ascending positions in the factor of the free stored dofs
  std::vector<std::int64_t> place_;        // [order] index of a stored dof in positions_, -1 if held
  std::vector<std::int64_t> free_before_;  // [order + 1] number of free stored dofs before it
};

}  // namespace palpate
