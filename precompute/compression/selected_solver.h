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
/// In single precision (`Real` float) it has a copy of the factor's numbers, which must all be here.
template <class Real>
class SelectedSolverOf {
 public:
  using SweepWorkspace = typename SupernodalSweeps<Real>::Workspace;

  /// Scratch of one thread.
  struct Workspace {
    SweepWorkspace sweep;
    std::vector<std::uint8_t> wanted;  // [supernodes]
  };

  /// `jobs`: threads that copy.
  explicit SelectedSolverOf(const Factor& factor, int jobs = 1);

  [[nodiscard]] const Factor& factor() const noexcept { return sweeps_.factor(); }

  /// Xi(rows, columns) [rows x columns] row-major [m/N] to `block`. Rows and columns are dofs of K; -1 is a
  /// held dof, with zeros.
  void solve(std::span<const std::int64_t> rows, std::span<const std::int64_t> columns, Workspace& workspace,
             std::span<Real> block) const;

  /// u = Xi f for loads f [dofs x columns] on some dofs, with displacements u of the same dofs, both
  /// row-major. Loads on a dof that is there twice add up.
  void multiply(std::span<const std::int64_t> dofs, std::int64_t columns, std::span<const Real> f,
                Workspace& workspace, std::span<Real> u) const;

  /// Multiplications and additions of `solve`.
  [[nodiscard]] double flops(std::span<const std::int64_t> rows, std::span<const std::int64_t> columns) const;

  [[nodiscard]] std::int64_t workspace_bytes(std::int64_t columns) const {
    return sweeps_.workspace_bytes(columns);
  }

 private:
  void clear_path(std::int64_t width, SweepWorkspace& sweep) const;
  void sweep(std::int64_t width, Workspace& workspace) const;
  void mark(std::span<const std::int64_t> dofs, std::vector<std::uint8_t>& marks) const;

  SupernodalSweeps<Real> sweeps_;
  std::vector<std::int64_t> position_;  // [n] of each dof of K in the factor
};

using SelectedSolver = SelectedSolverOf<double>;

}  // namespace palpate
