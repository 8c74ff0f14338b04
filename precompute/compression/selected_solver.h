// Blocks of Xi = K^-1 for selected rows and columns, from a supernodal Cholesky factor.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/numerics/supernodal_sweeps.h"

namespace palpate {

/// Y = L^-1 of unit loads on the dofs of some clusters [N^-1/2 m^1/2], which is zero but on the paths of the
/// elimination tree from the dofs to the root. As Xi = L^-T L^-1, a block of it is a product of two: half of
/// the work of solving for it, or less where each serves several blocks. The more clusters, the less often
/// the factor is read; near each other in the body, they have most of their paths in common.
template <class Real>
struct ForwardSolution {
  static constexpr std::size_t most_clusters = 8;

  std::vector<std::int64_t> column;      ///< [clusters + 1] first column of each in Y
  std::vector<std::int64_t> supernodes;  ///< on any path, ascending
  std::vector<std::uint8_t> on_path;     ///< [supernodes] bit c is set where it is on a path from cluster c
  std::vector<std::int64_t> row;         ///< [supernodes + 1] first row of each in Y
  std::vector<Real> Y;                   ///< [rows x columns], row-major

  [[nodiscard]] std::int64_t bytes() const noexcept { return std::ssize(Y) * std::int64_t{sizeof(Real)}; }
};

/// Clusters [first, end) of a forward solution.
template <class Real>
struct ForwardColumns {
  const ForwardSolution<Real>& of;
  std::size_t first, end;

  [[nodiscard]] std::int64_t count() const noexcept { return of.column[end] - of.column[first]; }
  /// Columns at a supernode, the k-th of the solution.
  [[nodiscard]] const Real* at(std::size_t k) const noexcept {
    return of.Y.data() + of.row[k] * of.column.back() + of.column[first];
  }
  [[nodiscard]] bool on_path(std::size_t k) const noexcept {
    return (of.on_path[k] >> first & ((1U << (end - first)) - 1U)) != 0;
  }
};

/// block = Xi(rows, columns) = Y_rows^T Y_columns [rows x columns], row-major [m/N].
template <class Real>
void multiply(const ForwardColumns<Real>& rows, const ForwardColumns<Real>& columns, std::span<Real> block);

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
    std::vector<std::int64_t> row;     // [supernodes]
  };

  /// `jobs`: threads that copy.
  explicit SelectedSolverOf(const Factor& factor, int jobs = 1);

  [[nodiscard]] const Factor& factor() const noexcept { return sweeps_.factor(); }

  /// Xi(rows, columns) [rows x columns] row-major [m/N] to `block`. Rows and columns are dofs of K; -1 is a
  /// held dof, with zeros.
  void solve(std::span<const std::int64_t> rows, std::span<const std::int64_t> columns, Workspace& workspace,
             std::span<Real> block) const;

  /// Forward solution of unit loads on the dofs of up to most_clusters clusters; -1 has zeros.
  [[nodiscard]] ForwardSolution<Real> forward(std::span<const std::vector<std::int64_t>> clusters,
                                              Workspace& workspace) const;

  /// u = Xi f for loads f [dofs x columns] on some dofs, with displacements u of the same dofs, both
  /// row-major. Loads on a dof that is there twice add up.
  void multiply(std::span<const std::int64_t> dofs, std::int64_t columns, std::span<const Real> f,
                Workspace& workspace, std::span<Real> u) const;

  /// Multiplications and additions of `forward`, for one cluster.
  [[nodiscard]] double forward_flops(std::span<const std::int64_t> dofs) const;
  /// Memory of `forward`, for the dofs of all clusters.
  [[nodiscard]] std::int64_t forward_bytes(std::span<const std::int64_t> dofs) const;

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
