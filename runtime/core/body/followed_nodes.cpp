#include "runtime/core/body/followed_nodes.h"

#include <algorithm>

namespace palpate {

FollowedNodes::FollowedNodes(int dimension, Index places, Index most_parts, Index stored_nodes)
    : dimension_(dimension),
      most_parts_(most_parts),
      stored_(static_cast<std::size_t>(std::min(most_parts * places, stored_nodes))),
      uses_(stored_.size()),
      number_(static_cast<std::size_t>(stored_nodes), -1),
      parts_(static_cast<std::size_t>(most_parts * places)),
      part_count_(static_cast<std::size_t>(places)),
      force_(static_cast<std::size_t>(dimension) * stored_.size()) {}

void FollowedNodes::add(Index place, Index stored, double weight) noexcept {
  Index& number = number_[static_cast<std::size_t>(stored)];
  if (number < 0) {
    number = count_++;
    stored_[static_cast<std::size_t>(number)] = stored;
    uses_[static_cast<std::size_t>(number)] = 0;
  }
  ++uses_[static_cast<std::size_t>(number)];
  Index& count = part_count_[static_cast<std::size_t>(place)];
  parts_[first(place) + static_cast<std::size_t>(count++)] = {number, weight};
}

void FollowedNodes::leave(Index place, Index places) noexcept {
  for (const Part& part : parts(place)) {
    const auto number = static_cast<std::size_t>(part.number);
    if (--uses_[number] > 0) continue;
    number_[static_cast<std::size_t>(stored_[number])] = -1;
    const auto last = static_cast<std::size_t>(--count_);
    if (number == last) continue;
    stored_[number] = stored_[last];
    uses_[number] = uses_[last];
    number_[static_cast<std::size_t>(stored_[number])] = static_cast<Index>(number);
    for (Index other = 0; other < places; ++other) {
      for (std::size_t k = first(other); k < first(other) + parts(other).size(); ++k) {
        if (parts_[k].number == static_cast<Index>(last)) parts_[k].number = static_cast<Index>(number);
      }
    }
  }
  part_count_[static_cast<std::size_t>(place)] = 0;
}

void FollowedNodes::move(Index from, Index to) noexcept {
  part_count_[static_cast<std::size_t>(to)] = part_count_[static_cast<std::size_t>(from)];
  std::copy_n(parts_.begin() + static_cast<std::ptrdiff_t>(first(from)), most_parts_,
              parts_.begin() + static_cast<std::ptrdiff_t>(first(to)));
  if (from != to) part_count_[static_cast<std::size_t>(from)] = 0;
}

void FollowedNodes::unload() noexcept {
  std::fill_n(force_.data(), forces().size(), 0.0);
}

void FollowedNodes::load(const Part& part, const Vec3& force) noexcept {
  double* on_node = force_.data() + std::ptrdiff_t{dimension_} * part.number;
  for (int axis = 0; axis < dimension_; ++axis) on_node[axis] += part.weight * force[axis];
}

}  // namespace palpate
