// Columns of Xi = K^-1 for the stored dofs, from a supernodal Cholesky factor.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/numerics/factor.h"

namespace palpate {

/// Computes blocks of columns of the lower triangle of Xi restricted to the stored dofs, which are numbered
/// by their position in the elimination order. For a block whose first column is at position p
///
///   forward   L Y = E   visits only the supernodes on the elimination-tree paths from the block's dofs to
///   the root, backward  L^T X = Y visits only supernodes at or after p (rows above the diagonal are another
///   block's columns) that
///                       hold a stored dof or have one below them,
///
/// and in both, supernode s works only on the columns whose position is not after it. Right-hand sides are
/// contiguous a dof, so that gathering the rows of a supernode copies whole cache lines. Const: any number of
/// threads may compute blocks.
class GreensSolver {
 public:
  /// Scratch of one thread.
  class Workspace {
    friend class GreensSolver;
    std::vector<double> X_;              // [n, width] row-major: row p is the dof at position p of the factor
    std::vector<double> below_;          // [rows below the largest supernode, width]
    std::vector<std::uint8_t> on_path_;  // [supernodes]
  };

  /// `factor` may be only analysed as long as nothing but the sizes and costs are asked for.
  /// `stored` [n] marks the dofs of K whose rows and columns are wanted, those of a node together;
  /// `mesh_dofs` [n] are their dofs of the mesh, `d` node + axis. Nodes are stored whole: an axis that a node
  /// is held along has no dof in K, and its row and column are zero.
  GreensSolver(const Factor& factor, const std::vector<std::uint8_t>& stored,
               std::span<const std::int64_t> mesh_dofs, int d);

  /// Number of stored dofs, held ones of stored nodes among them.
  [[nodiscard]] std::int64_t order() const noexcept { return static_cast<std::int64_t>(place_.size()); }

  /// Dof of K of each stored dof, in the order of the columns; -1 where it is held.
  [[nodiscard]] std::vector<std::int64_t> stored_dofs() const;

  /// Columns [first, first + count) of the lower triangle, one after the other, each from its diagonal down,
  /// to `packed` (resized).
  void columns(std::int64_t first, std::int64_t count, Workspace& workspace,
               std::vector<double>& packed) const;

  /// Multiplications and additions that `columns(first, count)` takes.
  [[nodiscard]] double flops(std::int64_t first, std::int64_t count) const;

  /// Bytes of one thread's workspace for blocks of `width` columns.
  [[nodiscard]] std::int64_t workspace_bytes(std::int64_t width) const;

 private:
  struct Supernode {
    std::int64_t first;        // position of its first column
    std::int64_t columns;      // number of columns
    std::int64_t below;        // rows under the diagonal block
    std::int64_t rows;         // offset of its row positions in rows_
    std::int64_t values;       // offset of its entries in the factor
    std::int64_t parent;       // supernode of the first row below, -1 for a root
    std::int64_t subtree;      // position of the first column of its subtree
    std::int64_t last_stored;  // largest stored position <= its last column, -1 if none
    [[nodiscard]] std::int64_t end() const noexcept { return first + columns; }
  };

  /// Those of the stored dofs [first, first + count) that are free: a range of positions_.
  [[nodiscard]] std::span<const std::int64_t> free_positions(std::int64_t first, std::int64_t count) const;
  void mark_paths(std::span<const std::int64_t> block, std::vector<std::uint8_t>& on_path) const;
  [[nodiscard]] bool needed(const Supernode& s, std::int64_t first_position) const noexcept;
  void forward(const Supernode& s, std::int64_t active, std::int64_t width, Workspace& workspace) const;
  void backward(const Supernode& s, bool on_path, std::int64_t active, std::int64_t width,
                Workspace& workspace) const;

  const Factor& factor_;
  std::vector<Supernode> supernodes_;
  std::vector<std::int64_t> supernode_of_;  // [n] supernode of each position
  std::vector<std::int64_t> positions_;     // ascending positions in the factor of the free stored dofs
  std::vector<std::int64_t> place_;         // [order] where a stored dof is in positions_, -1 where held
  std::vector<std::int64_t> free_before_;   // [order + 1] how many of the stored dofs before it are free
  std::int64_t max_below_ = 0;
};

}  // namespace palpate
