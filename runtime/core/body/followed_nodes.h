// The stored nodes that surface nodes near the tools follow.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/memory.h"
#include "base/vectors.h"
#include "runtime/core/body/greens.h"

namespace palpate {

/// Stored nodes that the surface nodes at some places follow, each once however many follow it, the forces on
/// them, and the compliance between them. All memory is taken at construction.
class FollowedNodes {
 public:
  /// One of the stored nodes that a place follows.
  struct Part {
    Index number = 0;     ///< of the stored node in nodes()
    double weight = 0.0;  ///< SurfaceParts::weights
  };

  /// Capacity for `places` with up to `most_parts` parts each, of a body with so many stored nodes. `shared`:
  /// several places follow the same nodes, whose compliance is kept.
  FollowedNodes(int dimension, Index places, Index most_parts, Index stored_nodes, bool shared);

  /// The stored nodes that are followed, in no order.
  [[nodiscard]] std::span<const Index> nodes() const noexcept {
    return {stored_.data(), static_cast<std::size_t>(count_)};
  }
  [[nodiscard]] Index room() const noexcept { return static_cast<Index>(stored_.size()); }
  /// Parts of a place, in the order in which they were added.
  [[nodiscard]] std::span<const Part> parts(Index place) const noexcept {
    return {parts_.data() + first(place),
            static_cast<std::size_t>(part_count_[static_cast<std::size_t>(place)])};
  }

  /// A place follows a stored node, beside those that it follows already.
  void add(Index place, Index stored, double weight) noexcept;
  /// A place follows none any more. Stored nodes that no other of the first `places` follows are forgotten;
  /// the last one takes the place of one that goes.
  void leave(Index place, Index places) noexcept;
  /// Moves the parts of a place to one that follows none.
  void move(Index from, Index to) noexcept;

  /// Green's functions between the nodes of a place's parts and all nodes(), [d x d nodes()]: those of each
  /// part's node times its weight, added to `rows`. The nodes' own are gathered once and kept, as many
  /// surface nodes follow the same.
  void add_compliance(const Greens& greens, Index place, std::span<double> rows) noexcept;
  /// Drops what is kept: the Green's functions have changed.
  void forget_compliance() noexcept { known_ = 0; }

  /// Removes all forces.
  void unload() noexcept;
  /// Adds a force on the place to that of the stored node, by the part's weight [N].
  void load(const Part& part, const Vec3& force) noexcept;
  /// [d nodes()] forces on the stored nodes [N].
  [[nodiscard]] std::span<const double> forces() const noexcept {
    return {force_.data(), static_cast<std::size_t>(dimension_) * static_cast<std::size_t>(count_)};
  }

 private:
  void gather(const Greens& greens) noexcept;
  void move_compliance(Index from, Index to) noexcept;
  [[nodiscard]] std::size_t first(Index place) const noexcept {
    return static_cast<std::size_t>(most_parts_) * static_cast<std::size_t>(place);
  }

  int dimension_;
  Index most_parts_;
  Index count_ = 0;
  std::vector<Index> stored_;       // [most parts x places, of the stored nodes at most]
  std::vector<Index> uses_;         // [as these] parts that are of each
  std::vector<Index> number_;       // [stored nodes] in stored_, -1: not followed
  std::vector<Part> parts_;         // [most parts x places]
  std::vector<Index> part_count_;   // [places]
  std::vector<double> force_;       // [d x stored_]
  Index kept_;                      // capacity of compliance_
  Index known_ = 0;                 // the first of the nodes have theirs in compliance_
  LargeVector<double> compliance_;  // [d kept x d kept] between nodes
  std::vector<double> gathered_;    // [d x d stored_]
};

}  // namespace palpate
