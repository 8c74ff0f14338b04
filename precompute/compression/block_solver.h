// Blocks of Xi between clusters of dofs.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "matrices/hierarchical.h"
#include "precompute/compression/selected_solver.h"

namespace palpate {

/// Clusters of a level that are solved for together: as many as there are in a forward solution, unless there
/// would be few groups for many threads.
inline Index clusters_together(int level) noexcept {
  constexpr int groups = 64;
  return std::clamp((Index{1} << level) / groups, Index{1},
                    static_cast<Index>(ForwardSolution<double>::most_clusters));
}

/// Solver for blocks of Xi between the clusters of a level, each a product of two forward solutions. Those
/// are made for groups of clusters when first asked for; the ones used last are kept in a limited memory, and
/// others made again, with the same numbers. Clusters that follow each other are near each other in the body:
/// where an eighth of all is kept, a fifth to a third are made twice for near pairs, a quarter to a half for
/// far ones (measured on bodies of 20 000 and 100 000 surface nodes). A factor that is spread over processes
/// solves for each column.
template <class Real>
class BlockSolver {
 public:
  using Dofs = std::vector<std::int64_t>;

  /// `dofs_of`: dofs of K of a cluster, -1 where held. `most_bytes` of forward solutions are kept beyond
  /// those in use by `jobs` threads. Keeps a reference to the solver.
  BlockSolver(const SelectedSolverOf<Real>& solver, const ClusterTree& tree, int level, int jobs,
              std::int64_t most_bytes, std::function<Dofs(Index cluster)> dofs_of);

  /// Xi(rows, column) to `block`, the clusters of rows one below the other, row-major [m/N]. Called by thread
  /// `worker` in [0, jobs).
  void solve(std::span<const Index> rows, Index column, int worker, std::span<Real> block);

 private:
  using Solution = std::shared_ptr<const ForwardSolution<Real>>;
  using Promised = std::shared_future<Solution>;
  struct Kept {
    Promised solution;
    std::int64_t used = 0;   // number of the last use
    std::int64_t bytes = 0;  // 0 until it is made
  };

  [[nodiscard]] Index group_of(Index cluster) const { return (cluster - first_) / together_; }
  Promised forward(Index group, int worker);
  bool look_ahead(Index group, int worker);
  void keep(Index group, std::int64_t bytes);

  Index first_;     // cluster of the level
  Index together_;  // clusters of a group
  Index groups_;    // of the level

  const SelectedSolverOf<Real>& solver_;
  std::vector<typename SelectedSolverOf<Real>::Workspace> workspaces_;  // [jobs]
  std::int64_t most_bytes_;
  std::function<Dofs(Index cluster)> dofs_of_;
  std::mutex mutex_;  // of what follows
  std::map<Index, Kept> kept_;
  std::int64_t bytes_ = 0, uses_ = 0;
};

}  // namespace palpate
