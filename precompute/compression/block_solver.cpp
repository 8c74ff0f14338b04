#include "precompute/compression/block_solver.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

namespace palpate {

template <class Real>
BlockSolver<Real>::BlockSolver(const SelectedSolverOf<Real>& solver, const ClusterTree& tree, int level,
                               int jobs, std::int64_t most_bytes, std::function<Dofs(Index cluster)> dofs_of)
    : first_(tree.first_of_level(level)),
      together_(clusters_together(level)),
      groups_((Index{1} << level) / together_),
      solver_(solver),
      workspaces_(static_cast<std::size_t>(jobs)),
      most_bytes_(most_bytes),
      dofs_of_(std::move(dofs_of)) {}

template <class Real>
void BlockSolver<Real>::solve(std::span<const Index> rows, Index column, int worker, std::span<Real> block) {
  if (rows.empty()) return;
  if (solver_.factor().spread_numbers() != nullptr) {
    Dofs dofs;
    for (const Index row : rows) {
      const Dofs more = dofs_of_(row);
      dofs.insert(dofs.end(), more.begin(), more.end());
    }
    return solver_.solve(dofs, dofs_of_(column), workspaces_[static_cast<std::size_t>(worker)], block);
  }
  // What no thread has begun is made before others are waited for.
  const Promised own = forward(group_of(column), worker);
  std::map<Index, Promised> others;
  for (const Index row : rows)
    if (!others.contains(group_of(row))) others.emplace(group_of(row), forward(group_of(row), worker));
  for (const auto& [group, solution] : others) {
    while (solution.wait_for(std::chrono::seconds(0)) != std::future_status::ready &&
           look_ahead(group_of(column), worker)) {
    }
  }
  const auto columns_of = [&](const Promised& solution, Index from, Index end) {
    const Index begin = first_ + group_of(from) * together_;
    return ForwardColumns<Real>{*solution.get(), static_cast<std::size_t>(from - begin),
                                static_cast<std::size_t>(end - begin)};
  };
  const ForwardColumns<Real> of_column = columns_of(own, column, column + 1);
  for (std::size_t k = 0; k < rows.size();) {
    const Index from = rows[k], group = group_of(from);
    Index end = from;  // of clusters that follow each other in a group
    for (; k < rows.size() && rows[k] == end && group_of(end) == group; ++k) ++end;
    const ForwardColumns<Real> of_rows = columns_of(others.at(group), from, end);
    const auto size = static_cast<std::size_t>(of_rows.count() * of_column.count());
    multiply(of_rows, of_column, block.first(size));
    block = block.subspan(size);
  }
}

/// The forward solution of a group, which the first thread that asks for it makes.
template <class Real>
typename BlockSolver<Real>::Promised BlockSolver<Real>::forward(Index group, int worker) {
  std::promise<Solution> promise;
  Promised promised = promise.get_future().share();
  {
    const std::scoped_lock lock(mutex_);
    Kept& kept = kept_[group];
    kept.used = ++uses_;
    if (kept.solution.valid()) return kept.solution;
    kept.solution = promised;
  }
  try {
    std::vector<Dofs> clusters;
    clusters.reserve(static_cast<std::size_t>(together_));
    for (Index c = 0; c < together_; ++c) clusters.push_back(dofs_of_(first_ + group * together_ + c));
    promise.set_value(std::make_shared<const ForwardSolution<Real>>(
        solver_.forward(clusters, workspaces_[static_cast<std::size_t>(worker)])));
  } catch (...) {
    promise.set_exception(std::current_exception());
  }
  keep(group, promised.get()->bytes());
  return promised;
}

/// Makes a solution of a later group, which is likely wanted soon. False if there is none left to make.
template <class Real>
bool BlockSolver<Real>::look_ahead(Index group, int worker) {
  {
    const std::scoped_lock lock(mutex_);
    do {
      if (++group == groups_) return false;
    } while (kept_.contains(group));
  }
  forward(group, worker);
  return true;
}

/// Counts a solution, and lets those go that were not used for longest where they are too many.
template <class Real>
void BlockSolver<Real>::keep(Index group, std::int64_t bytes) {
  const std::scoped_lock lock(mutex_);
  kept_.at(group).bytes = bytes;
  bytes_ += bytes;
  while (bytes_ > most_bytes_) {
    const auto goes = std::min_element(kept_.begin(), kept_.end(), [](const auto& a, const auto& b) {
      return std::pair(a.second.bytes == 0, a.second.used) < std::pair(b.second.bytes == 0, b.second.used);
    });
    bytes_ -= goes->second.bytes;
    kept_.erase(goes);
  }
}

template class BlockSolver<double>;
template class BlockSolver<float>;

}  // namespace palpate
