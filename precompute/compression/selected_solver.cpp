#include "precompute/compression/selected_solver.h"

#include <algorithm>
#include <bit>
#include <functional>
#include <type_traits>

#include "precompute/numerics/spread_numbers.h"

namespace palpate {
namespace {

/// C += A^T B, A [k x m], B [k x n], all row-major.
void add_product(std::int64_t m, std::int64_t n, std::int64_t k, const double* A, std::int64_t lda,
                 const double* B, std::int64_t ldb, double* C) {
  cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, blas(m), blas(n), blas(k), 1.0, A, blas(lda), B,
              blas(ldb), 1.0, C, blas(n));
}
void add_product(std::int64_t m, std::int64_t n, std::int64_t k, const float* A, std::int64_t lda,
                 const float* B, std::int64_t ldb, float* C) {
  cblas_sgemm(CblasRowMajor, CblasTrans, CblasNoTrans, blas(m), blas(n), blas(k), 1.0F, A, blas(lda), B,
              blas(ldb), 1.0F, C, blas(n));
}

}  // namespace

template <class Real>
void multiply(const ForwardColumns<Real>& rows, const ForwardColumns<Real>& columns, std::span<Real> block) {
  std::fill(block.begin(), block.end(), Real(0));
  const std::vector<std::int64_t>&s = rows.of.supernodes, &t = columns.of.supernodes;
  const auto common = [&](std::size_t i, std::size_t j) {
    return i < s.size() && j < t.size() && s[i] == t[j] && rows.on_path(i) && columns.on_path(j);
  };
  for (std::size_t i = 0, j = 0; i < s.size() && j < t.size();) {
    std::size_t run = 0;  // of supernodes that follow each other in both
    while (common(i + run, j + run)) ++run;
    if (run > 0) {
      add_product(rows.count(), columns.count(), rows.of.row[i + run] - rows.of.row[i], rows.at(i),
                  rows.of.column.back(), columns.at(j), columns.of.column.back(), block.data());
      i += run;
      j += run;
    } else {
      const bool first = s[i] <= t[j], second = t[j] <= s[i];
      i += first ? 1 : 0;
      j += second ? 1 : 0;
    }
  }
}

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

template <class Real>
ForwardSolution<Real> SelectedSolverOf<Real>::forward(std::span<const std::vector<std::int64_t>> clusters,
                                                      Workspace& workspace) const {
  const std::span<const Supernode> supernodes = sweeps_.supernodes();
  std::vector<std::uint8_t>& on_path = workspace.wanted;
  on_path.assign(supernodes.size(), 0);
  ForwardSolution<Real> solution;
  solution.column = {0};
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    mark(clusters[c], workspace.sweep.on_path);
    for (std::size_t s = 0; s < on_path.size(); ++s)
      on_path[s] = static_cast<std::uint8_t>(on_path[s] | workspace.sweep.on_path[s] << c);
    solution.column.push_back(solution.column.back() + std::ssize(clusters[c]));
  }
  workspace.row.resize(supernodes.size());
  std::int64_t rows = 0;
  for (std::size_t s = 0; s < on_path.size(); ++s) {
    if (on_path[s] == 0) continue;
    solution.supernodes.push_back(static_cast<std::int64_t>(s));
    solution.on_path.push_back(on_path[s]);
    solution.row.push_back(workspace.row[s] = rows);
    rows += supernodes[s].columns;
  }
  solution.row.push_back(rows);
  const std::int64_t width = solution.column.back();
  solution.Y.resize(static_cast<std::size_t>(rows * width));
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    for (std::size_t i = 0; i < clusters[c].size(); ++i) {
      if (clusters[c][i] < 0) continue;
      const std::int64_t position = position_[static_cast<std::size_t>(clusters[c][i])];
      const auto s = static_cast<std::size_t>(sweeps_.supernode_of(position));
      const std::int64_t row = workspace.row[s] + position - supernodes[s].first;
      solution.Y[static_cast<std::size_t>(row * width + solution.column[c]) + i] = Real(1);
    }
  }
  for (std::size_t k = 0; k < solution.supernodes.size(); ++k) {
    const auto from = static_cast<std::size_t>(std::countr_zero(solution.on_path[k])),
               to = static_cast<std::size_t>(std::bit_width(solution.on_path[k]));
    sweeps_.forward(supernodes[static_cast<std::size_t>(solution.supernodes[k])], workspace.row,
                    solution.column[from], solution.column[to], width, solution.Y.data(),
                    workspace.sweep.below);
  }
  return solution;
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
double SelectedSolverOf<Real>::forward_flops(std::span<const std::int64_t> dofs) const {
  std::vector<std::uint8_t> on_path;
  mark(dofs, on_path);
  double of_column = 0.0;
  for (std::size_t s = 0; s < on_path.size(); ++s) {
    const Supernode& node = sweeps_.supernodes()[s];
    if (on_path[s]) of_column += static_cast<double>(node.columns * (node.columns + 2 * node.below));
  }
  return of_column * static_cast<double>(dofs.size());
}

template <class Real>
std::int64_t SelectedSolverOf<Real>::forward_bytes(std::span<const std::int64_t> dofs) const {
  std::vector<std::uint8_t> on_path;
  mark(dofs, on_path);
  std::int64_t rows = 0;
  for (std::size_t s = 0; s < on_path.size(); ++s)
    if (on_path[s] != 0) rows += sweeps_.supernodes()[s].columns;
  return rows * std::ssize(dofs) * std::int64_t{sizeof(Real)};
}

template void multiply(const ForwardColumns<double>&, const ForwardColumns<double>&, std::span<double>);
template void multiply(const ForwardColumns<float>&, const ForwardColumns<float>&, std::span<float>);
template class SelectedSolverOf<double>;
template class SelectedSolverOf<float>;

}  // namespace palpate
