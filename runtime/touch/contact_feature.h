// The numbers by which a contact point is found again in the next tick.
#pragma once

#include <algorithm>
#include <cstdint>

#include "meshes/mesh.h"

namespace palpate {

/// What of the surface a contact point is at.
enum class FeatureKind : std::uint8_t { group, vertex, edge, face };

/// From the highest bits: tool (0 to 511), place on the tool (0 to 15), kind, and twice 24 bits for the
/// numbers of a group, a surface node, an edge's two or a simplex. The same place of the surface and the tool
/// has the same number.
constexpr std::int64_t contact_feature(Index tool, int place, FeatureKind kind, Index a,
                                       Index b = 0) noexcept {
  const std::int64_t head = (std::int64_t{tool} * 16 + place) * 4 + static_cast<int>(kind);
  const Index low = kind == FeatureKind::edge ? std::min(a, b) : 0;
  const Index high = kind == FeatureKind::edge ? std::max(a, b) : a;
  return (head << 48) + (std::int64_t{low} << 24) + high;
}

/// The kind of a feature.
constexpr FeatureKind kind_of(std::int64_t feature) noexcept {
  return static_cast<FeatureKind>((feature >> 48) & 3);
}

/// Whether two features are of the same kind and place on the same tool.
constexpr bool are_alike(std::int64_t a, std::int64_t b) noexcept {
  return a >> 48 == b >> 48;
}

/// The feature of the same tool and place with another kind and number.
constexpr std::int64_t with_kind(std::int64_t feature, FeatureKind kind, Index number) noexcept {
  const std::int64_t head = (feature >> 48) / 4 * 4 + static_cast<int>(kind);
  return (head << 48) + number;
}

}  // namespace palpate
