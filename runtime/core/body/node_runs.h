// Runs of stored nodes, and their neighbours on the surface.
#pragma once

#include <span>
#include <vector>

#include "base/vectors.h"

namespace palpate {

/// Partition of the stored nodes 0, 1, 2 ... into runs of equal length. Reading the rows of a run from the
/// Green's functions takes little longer than those of one node, and with usual numberings many nodes of a
/// run are neighbours.
class NodeRuns {
 public:
  NodeRuns() = default;
  /// Divides `nodes` stored nodes into runs of `length`, on a surface with these simplices [F * d] of surface
  /// nodes that follow `stored` [S], -1 for none.
  NodeRuns(Index length, Index nodes, int d, std::span<const Index> simplices, std::span<const Index> stored);

  [[nodiscard]] Index count() const noexcept { return static_cast<Index>(first_.size()) - 1; }
  [[nodiscard]] Index of(Index stored) const noexcept { return stored / length_; }  ///< run of a stored node
  [[nodiscard]] Index begin(Index run) const noexcept { return run * length_; }     ///< first node of a run
  /// One past the last node of a run.
  [[nodiscard]] Index end(Index run) const noexcept {
    return begin(run) + length_ < nodes_ ? begin(run) + length_ : nodes_;
  }
  /// Other runs that have simplices in common with a run.
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
