#include "precompute/compression/selected_solver.h"

#include <algorithm>
#include <functional>
#include <type_traits>

#include "precompute/numerics/spread_numbers.h"

namespace palpate {

template <class Real>
SelectedSolverOf<Real>::SelectedSolverOf(const Factor& factor, int jobs)
    : sweeps_(factor, jobs), position_(static_cast<std::size_t>(factor.order())) {
  const std::span<const std::int64_t> permutation = factor.permutation();
  for (std::size_t p = 0; p < permutation.size(); ++p)
    position_[static_cast<std::size_t>(permutation[p])] = static_cast<std::int64_t>(p);
}

template <class Real>
void SelectedSolverOf<Real>::mark(std::span<const std::int64_t> dofs,
                                  std::vector<std::uint8_t>& marks) const {
  marks.assign(sweeps_.supernodes().size(), 0);
  for (const std::int64_t dof : dofs)
    if (dof >= 0) sweeps_.mark_path(position_[static_cast<std::size_t>(dof)], marks);
}

template <class Real>
void SelectedSolverOf<Real>::solve(std::span<const std::int64_t> rows, std::span<const std::int64_t> columns,
                                   Workspace& workspace, std::span<Real> block) const {
  std::fill(block.begin(), block.end(), Real(0));
  if (columns.empty() || rows.empty()) return;
  const auto width = static_cast<std::int64_t>(columns.size());
  if constexpr (std::is_same_v<Real, double>) {
    if (SpreadNumbers* spread = sweeps_.factor().spread_numbers(); spread != nullptr) {
      std::vector<double> ones(columns.size() * columns.size(), 0.0);
      for (std::size_t c = 0; c < columns.size(); ++c) ones[c * columns.size() + c] = 1.0;
      return spread->multiply(columns, width, ones, rows, block);
    }
  }
  SweepWorkspace& sweep = workspace.sweep;
  sweeps_.prepare(sweep, width);
  mark(columns, sweep.on_path);
  mark(rows, workspace.wanted);
  clear_path(width, sweep);
  for (std::int64_t c = 0; c < width; ++c) {
    const std::int64_t dof = columns[static_cast<std::size_t>(c)];
    if (dof >= 0)
      sweep.X[static_cast<std::size_t>(position_[static_cast<std::size_t>(dof)] * width + c)] = Real(1);
  }
  this->sweep(width, workspace);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    if (rows[r] < 0) continue;
    const Real* row = sweep.X.data() + position_[static_cast<std::size_t>(rows[r])] * width;
    std::copy_n(row, width, block.data() + static_cast<std::int64_t>(r) * width);
  }
}

/// Sets X to zero on the path.
template <class Real>
void SelectedSolverOf<Real>::clear_path(std::int64_t width, SweepWorkspace& sweep) const {
  const std::span<const Supernode> supernodes = sweeps_.supernodes();
  for (std::size_t s = 0; s < supernodes.size(); ++s) {
    if (sweep.on_path[s])
      std::fill_n(sweep.X.begin() + supernodes[s].first * width, supernodes[s].columns * width, Real(0));
  }
}

/// Runs both substitutions over the marked supernodes.
template <class Real>
void SelectedSolverOf<Real>::sweep(std::int64_t width, Workspace& workspace) const {
  SweepWorkspace& sweep = workspace.sweep;
  const std::span<const Supernode> supernodes = sweeps_.supernodes();
  for (std::size_t s = 0; s < supernodes.size(); ++s)
    if (sweep.on_path[s]) sweeps_.forward(supernodes[s], width, width, sweep);
  for (std::size_t s = supernodes.size(); s-- > 0;)
    if (workspace.wanted[s]) sweeps_.backward(supernodes[s], sweep.on_path[s] != 0, width, width, sweep);
}

template <class Real>
void SelectedSolverOf<Real>::multiply(std::span<const std::int64_t> dofs, std::int64_t columns,
                                      std::span<const Real> f, Workspace& workspace,
                                      std::span<Real> u) const {
  if constexpr (std::is_same_v<Real, double>) {
    if (SpreadNumbers* spread = sweeps_.factor().spread_numbers(); spread != nullptr)
      return spread->multiply(dofs, columns, f, dofs, u);
  }
  sweeps_.prepare(workspace.sweep, columns);
  mark(dofs, workspace.sweep.on_path);
  workspace.wanted = workspace.sweep.on_path;
  clear_path(columns, workspace.sweep);
  const auto row = [&](std::size_t i) {
    return workspace.sweep.X.begin() + position_[static_cast<std::size_t>(dofs[i])] * columns;
  };
  for (std::size_t i = 0; i < dofs.size(); ++i) {
    if (dofs[i] >= 0)
      std::transform(row(i), row(i) + columns, f.begin() + static_cast<std::int64_t>(i) * columns, row(i),
                     std::plus<>());
  }
  sweep(columns, workspace);
  std::fill(u.begin(), u.end(), Real(0));
  for (std::size_t i = 0; i < dofs.size(); ++i)
    if (dofs[i] >= 0) std::copy_n(row(i), columns, u.begin() + static_cast<std::int64_t>(i) * columns);
}

template <class Real>
double SelectedSolverOf<Real>::flops(std::span<const std::int64_t> rows,
                                     std::span<const std::int64_t> columns) const {
  std::vector<std::uint8_t> on_path, wanted;
  mark(columns, on_path);
  mark(rows, wanted);
  double total = 0.0;
  for (std::size_t s = 0; s < on_path.size(); ++s) {
    const Supernode& node = sweeps_.supernodes()[s];
    total += static_cast<double>(node.columns * (node.columns + 2 * node.below)) *
             ((on_path[s] ? 1.0 : 0.0) + (wanted[s] ? 1.0 : 0.0));
  }
  return total * static_cast<double>(columns.size());
}

template class SelectedSolverOf<double>;
template class SelectedSolverOf<float>;

}  // namespace palpate
