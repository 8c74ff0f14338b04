// Stored nodes in runs, and which runs lie beside each other on the surface.
#pragma once

#include <span>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// The stored nodes 0, 1, 2 ... cut into runs of equal length. A run of the Green's functions' rows is read
/// in little more time than one of its nodes; and as meshes are numbered, many nodes of a run are neighbours.
class NodeRuns {
 public:
  NodeRuns() = default;
  /// Runs of `length` of `nodes` stored nodes, on a surface with these simplices [F * d] of surface nodes
  /// that follow `stored` [S], -1 for none.
  NodeRuns(Index length, Index nodes, int d, std::span<const Index> simplices, std::span<const Index> stored);

  [[nodiscard]] Index count() const noexcept { return static_cast<Index>(first_.size()) - 1; }
  [[nodiscard]] Index of(Index stored) const noexcept { return stored / length_; }  ///< run of a stored node
  [[nodiscard]] Index begin(Index run) const noexcept { return run * length_; }     ///< its first node
  /// One past its last node.
  [[nodiscard]] Index end(Index run) const noexcept {
    return begin(run) + length_ < nodes_ ? begin(run) + length_ : nodes_;
  }
  /// Runs with which a run shares simplices, without itself.
  [[nodiscard]] std::span<const Index> beside(Index run) const noexcept {
    const auto k = static_cast<std::size_t>(run);
    return {beside_.data() + first_[k], static_cast<std::size_t>(first_[k + 1] - first_[k])};
  }

 private:
  Index length_ = 1;
  Index nodes_ = 0;
  std::vector<Index> first_ = {0};  // [runs + 1] in beside_
  std::vector<Index> beside_;
};

}  // namespace palpate
