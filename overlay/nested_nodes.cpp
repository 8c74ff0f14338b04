#include "overlay/nested_nodes.h"

#include <algorithm>

namespace palpate {
namespace {

/// Rank of each corner of a simplex by its node number.
std::array<int, 4> ranks(std::span<const Index> corners) {
  std::array<int, 4> rank{};
  for (std::size_t i = 0; i < std::min<std::size_t>(corners.size(), 4); ++i) {
    rank[i] = static_cast<int>(
        std::count_if(corners.begin(), corners.end(), [&](Index other) { return other < corners[i]; }));
  }
  return rank;
}

}  // namespace

NodeKey key_of(const Subdivision::Node& node, std::span<const Index> corners) {
  NodeKey key;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    if (node.weights[k] > 0) key.emplace_back(corners[k], node.weights[k]);
  }
  std::sort(key.begin(), key.end());
  return key;
}

const Subdivision& Subdivisions::of(std::span<const Index> corners) {
  const bool is_simplex = type_ != ElementType::quad4 && type_ != ElementType::hex8;
  const std::array<int, 4> order = is_simplex ? ranks(corners) : std::array<int, 4>{0, 1, 2, 3};
  const auto found = made_.find(order);
  return found != made_.end() ? found->second
                              : made_.emplace(order, subdivide(type_, r_, order)).first->second;
}

}  // namespace palpate
