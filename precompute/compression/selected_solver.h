// Blocks of Xi = K^-1 for selected rows and columns, from a supernodal Cholesky factor.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/numerics/supernodal_sweeps.h"

namespace palpate {

/// Solver for entries of Xi at selected rows and columns: forward substitution visits only the paths of the
/// elimination tree from the columns to the root, backward substitution those from the rows. Dofs that are
/// near each other in the body have most of their paths in common. Const: any number of threads may solve.
class SelectedSolver {
 public:
  /// Scratch of one thread.
  struct Workspace {
    SupernodalSweeps::Workspace sweep;
    std::vector<std::uint8_t> wanted;  // [supernodes]
  };

  explicit SelectedSolver(const Factor& factor);

  /// Xi(rows, columns) [rows x columns] row-major [m/N] to `block`. Rows and columns are dofs of K; -1 is a
  /// held dof, with zeros.
  void solve(std::span<const std::int64_t> rows, std::span<const std::int64_t> columns, Workspace& workspace,
             std::span<double> block) const;

  /// u = Xi f for loads f [dofs x columns] on some dofs, with displacements u of the same dofs, both
  /// row-major.
  void multiply(std::span<const std::int64_t> dofs, std::int64_t columns, std::span<const double> f,
                Workspace& workspace, std::span<double> u) const;

  /// Multiplications and additions of `solve`.
  [[nodiscard]] double flops(std::span<const std::int64_t> rows, std::span<const std::int64_t> columns) const;

  [[nodiscard]] std::int64_t workspace_bytes(std::int64_t columns) const {
    return sweeps_.workspace_bytes(columns);
  }

 private:
  void sweep(std::int64_t width, Workspace& workspace) const;
  void mark(std::span<const std::int64_t> dofs, std::vector<std::uint8_t>& marks) const;

  SupernodalSweeps sweeps_;
  std::vector<std::int64_t> position_;  // [n] of each dof of K in the factor
};

}  // namespace palpate
