#include "runtime/core/body/node_runs.h"

#include <set>

namespace palpate {

NodeRuns::NodeRuns(Index length, Index nodes, int d, std::span<const Index> simplices,
                   std::span<const Index> stored)
    : length_(length), nodes_(nodes) {
  std::vector<std::set<Index>> beside(static_cast<std::size_t>((nodes + length - 1) / length));
  const auto corners = static_cast<std::size_t>(d);
  const auto run_of = [&](std::size_t corner) {
    const Index node = stored[static_cast<std::size_t>(simplices[corner])];
    return node < 0 ? -1 : of(node);
  };
  for (std::size_t simplex = 0; simplex < simplices.size(); simplex += corners) {
    for (std::size_t a = simplex; a < simplex + corners; ++a) {
      for (std::size_t b = simplex; b < simplex + corners; ++b) {
        const Index from = run_of(a);
        const Index to = run_of(b);
        if (from >= 0 && to >= 0 && from != to) beside[static_cast<std::size_t>(from)].insert(to);
      }
    }
  }
  for (const std::set<Index>& runs : beside) {
    beside_.insert(beside_.end(), runs.begin(), runs.end());
    first_.push_back(static_cast<Index>(beside_.size()));
  }
}

}  // namespace palpate
