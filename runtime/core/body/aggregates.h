// Groups of neighbouring surface nodes, which a large tool loads as a whole.
#pragma once

#include <span>
#include <vector>

#include "base/vectors.h"

namespace palpate {

/// Groups of surface nodes, each a node with its neighbours, that cover all nodes that can move. The groups
/// are disjoint.
class SurfaceAggregates {
 public:
  SurfaceAggregates() = default;
  /// Groups the nodes of a surface with these simplices [F * d]. `moves` [S]: false for nodes held along
  /// every axis, which are in no group.
  SurfaceAggregates(int d, std::span<const Index> simplices, const std::vector<bool>& moves);

  [[nodiscard]] Index count() const noexcept { return static_cast<Index>(first_.size()) - 1; }
  /// Group of a surface node; -1 if none.
  [[nodiscard]] Index of_node(Index node) const noexcept { return of_node_[static_cast<std::size_t>(node)]; }
  /// Surface nodes of a group; nearly all are neighbours of the first.
  [[nodiscard]] std::span<const Index> members(Index group) const noexcept {
    const auto k = static_cast<std::size_t>(group);
    return {members_.data() + first_[k], static_cast<std::size_t>(first_[k + 1] - first_[k])};
  }
  /// Size of the largest group.
  [[nodiscard]] Index most_members() const noexcept { return most_members_; }

 private:
  std::vector<Index> of_node_;      // [S]
  std::vector<Index> first_ = {0};  // [groups + 1] in members_
  std::vector<Index> members_;
  Index most_members_ = 0;
};

}  // namespace palpate
