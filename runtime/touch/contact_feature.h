// The numbers by which a contact point is found again in the next tick.
#pragma once

#include <algorithm>
#include <cstdint>

#include "meshes/mesh.h"

namespace palpate {

/// What of the surface a contact point is at.
enum class FeatureKind : std::uint8_t { group, vertex, edge, face };

/// From the highest bits: tool (0 to 63), place on the tool (0 to 7), kind, and twice 26 bits for the numbers
/// of a group, a surface node, an edge's two or a simplex. The same place of the surface and the tool has the
/// same number.
constexpr std::int64_t contact_feature(Index tool, int place, FeatureKind kind, Index a,
                                       Index b = 0) noexcept {
  const std::int64_t head = (std::int64_t{tool} * 8 + place) * 4 + static_cast<int>(kind);
  const Index low = kind == FeatureKind::edge ? std::min(a, b) : 0;
  const Index high = kind == FeatureKind::edge ? std::max(a, b) : a;
  return (head << 52) + (std::int64_t{low} << 26) + high;
}

/// Whether two features are of the same kind and place on the same tool.
constexpr bool are_alike(std::int64_t a, std::int64_t b) noexcept {
  return a >> 52 == b >> 52;
}

/// The feature of the same tool and place with another kind and number.
constexpr std::int64_t with_kind(std::int64_t feature, FeatureKind kind, Index number) noexcept {
  const std::int64_t head = (feature >> 52) / 4 * 4 + static_cast<int>(kind);
  return (head << 52) + number;
}

}  // namespace palpate
