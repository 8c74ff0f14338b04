// Neighbouring surface nodes in groups, which a large tool presses on as one.
#pragma once

#include <span>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// A node of the surface with its neighbours, and so on until all that move are in one group. No two groups
/// share a node.
class SurfaceAggregates {
 public:
  SurfaceAggregates() = default;
  /// Groups the nodes of a surface with these simplices [F * d]. `moves` [S]: those that are held along every
  /// axis are in no group.
  SurfaceAggregates(int d, std::span<const Index> simplices, const std::vector<bool>& moves);

  [[nodiscard]] Index count() const noexcept { return static_cast<Index>(first_.size()) - 1; }
  /// Group of a surface node, -1 for none.
  [[nodiscard]] Index of_node(Index node) const noexcept { return of_node_[static_cast<std::size_t>(node)]; }
  /// Surface nodes of a group; the first has all others but few as its neighbours.
  [[nodiscard]] std::span<const Index> members(Index group) const noexcept {
    const auto k = static_cast<std::size_t>(group);
    return {members_.data() + first_[k], static_cast<std::size_t>(first_[k + 1] - first_[k])};
  }
  /// Members of the largest group.
  [[nodiscard]] Index most_members() const noexcept { return most_members_; }

 private:
  std::vector<Index> of_node_;      // [S]
  std::vector<Index> first_ = {0};  // [groups + 1] in members_
  std::vector<Index> members_;
  Index most_members_ = 0;
};

}  // namespace palpate
