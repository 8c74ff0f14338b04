#include "runtime/core/body/aggregates.h"

#include <algorithm>
#include <deque>

namespace palpate {
namespace {

std::size_t at(Index i) noexcept {
  return static_cast<std::size_t>(i);
}

/// Neighbours of each node, along edges.
struct Neighbours {
  std::vector<std::vector<Index>> of;

  Neighbours(std::size_t nodes, std::size_t corners, std::span<const Index> simplices) : of(nodes) {
    for (std::size_t simplex = 0; simplex < simplices.size(); simplex += corners) {
      for (std::size_t a = 0; a < corners; ++a) {
        for (std::size_t b = 0; b < corners; ++b) {
          if (a != b) of[at(simplices[simplex + a])].push_back(simplices[simplex + b]);
        }
      }
    }
    for (std::vector<Index>& nodes_beside : of) {
      std::sort(nodes_beside.begin(), nodes_beside.end());
      nodes_beside.erase(std::unique(nodes_beside.begin(), nodes_beside.end()), nodes_beside.end());
    }
  }
};

/// Aggregation as in algebraic multigrid (Vanek, Mandel, Brezina 1996): a node whose neighbours are all free
/// forms a group with them; remaining nodes join the smallest adjacent group. The surface is traversed
/// breadth first, so that groups lie side by side.
class Grouping {
 public:
  Grouping(const Neighbours& beside, const std::vector<bool>& moves)
      : beside_(beside), moves_(moves), group_(moves.size(), -1), seen_(moves.size(), false) {
    for (std::size_t seed = 0; seed < moves.size(); ++seed) found_groups(static_cast<Index>(seed));
    join_the_rest();
  }

  [[nodiscard]] const std::vector<std::vector<Index>>& members() const noexcept { return members_; }
  [[nodiscard]] const std::vector<Index>& group() const noexcept { return group_; }

 private:
  void found_groups(Index seed) {
    std::deque<Index> next{seed};
    while (!next.empty()) {
      const Index node = next.front();
      next.pop_front();
      if (seen_[at(node)]) continue;
      seen_[at(node)] = true;
      if (is_free(node)) found_group(node);
      for (const Index other : beside_.of[at(node)]) {
        if (!seen_[at(other)]) next.push_back(other);
      }
    }
  }

  [[nodiscard]] bool is_free(Index node) const {
    const auto free = [&](Index k) { return group_[at(k)] < 0; };
    return moves_[at(node)] && free(node) &&
           std::all_of(beside_.of[at(node)].begin(), beside_.of[at(node)].end(), free);
  }

  void found_group(Index centre) {
    const auto number = static_cast<Index>(members_.size());
    std::vector<Index>& members = members_.emplace_back(1, centre);
    for (const Index other : beside_.of[at(centre)]) {
      if (moves_[at(other)]) members.push_back(other);
    }
    for (const Index member : members) group_[at(member)] = number;
  }

  void join_the_rest() {
    for (std::size_t node = 0; node < group_.size(); ++node) {
      if (group_[node] >= 0 || !moves_[node]) continue;
      Index smallest = -1;
      for (const Index other : beside_.of[node]) {
        const Index group = group_[at(other)];
        if (group >= 0 && (smallest < 0 || members_[at(group)].size() < members_[at(smallest)].size()))
          smallest = group;
      }
      if (smallest < 0) continue;
      group_[node] = smallest;
      members_[at(smallest)].push_back(static_cast<Index>(node));
    }
  }

  const Neighbours& beside_;
  const std::vector<bool>& moves_;
  std::vector<Index> group_;
  std::vector<bool> seen_;
  std::vector<std::vector<Index>> members_;
};

}  // namespace

SurfaceAggregates::SurfaceAggregates(int d, std::span<const Index> simplices,
                                     const std::vector<bool>& moves) {
  const Neighbours beside(moves.size(), static_cast<std::size_t>(d), simplices);
  const Grouping grouping(beside, moves);
  of_node_ = grouping.group();
  for (const std::vector<Index>& members : grouping.members()) {
    members_.insert(members_.end(), members.begin(), members.end());
    first_.push_back(static_cast<Index>(members_.size()));
    most_members_ = std::max(most_members_, static_cast<Index>(members.size()));
  }
}

}  // namespace palpate
