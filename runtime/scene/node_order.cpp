#include "runtime/scene/node_order.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace palpate {
namespace {

constexpr unsigned bits = 20;  // per coordinate: cells of a millionth of the body
using Cell = std::array<std::uint32_t, 3>;

/// Returns the position of a cell along the curve (J. Skilling, Programming the Hilbert curve, AIP Conf.
/// Proc. 707, 2004).
std::uint64_t place_on_curve(Cell x) {
  for (std::uint32_t q = 1U << (bits - 1); q > 1; q >>= 1U) {
    const std::uint32_t low = q - 1;
    for (std::uint32_t& axis : x) {
      if ((axis & q) != 0) {
        x[0] ^= low;
      } else {
        const std::uint32_t swapped = (x[0] ^ axis) & low;
        x[0] ^= swapped;
        axis ^= swapped;
      }
    }
  }
  x[1] ^= x[0];
  x[2] ^= x[1];
  std::uint32_t flipped = 0;
  for (std::uint32_t q = 1U << (bits - 1); q > 1; q >>= 1U) {
    if ((x[2] & q) != 0) flipped ^= q - 1;
  }
  std::uint64_t place = 0;
  for (unsigned bit = bits; bit-- > 0;) {
    for (const std::uint32_t axis : x) place = place << 1U | (((axis ^ flipped) >> bit) & 1U);
  }
  return place;
}

}  // namespace

std::vector<Index> order_along_curve(std::span<const Vec3> nodes) {
  std::vector<Index> order(nodes.size());
  std::iota(order.begin(), order.end(), Index{0});
  if (nodes.empty()) return order;
  Vec3 low = nodes.front();
  Vec3 high = nodes.front();
  for (const Vec3& node : nodes) {
    low = low.cwiseMin(node);
    high = high.cwiseMax(node);
  }
  const double size = (high - low).maxCoeff();
  const double cells = size > 0.0 ? ((1U << bits) - 1) / size : 0.0;
  std::vector<std::uint64_t> places;
  places.reserve(nodes.size());
  for (const Vec3& node : nodes) {
    const Vec3 cell = cells * (node - low);
    places.push_back(
        place_on_curve({static_cast<std::uint32_t>(cell.x()), static_cast<std::uint32_t>(cell.y()),
                        static_cast<std::uint32_t>(cell.z())}));
  }
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) {
    return places[static_cast<std::size_t>(a)] < places[static_cast<std::size_t>(b)];
  });
  return order;
}

}  // namespace palpate
