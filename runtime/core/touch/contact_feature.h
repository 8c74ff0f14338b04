// Identifiers that match a contact point with the same one in the next tick.
#pragma once

#include <algorithm>
#include <cstdint>

#include "base/vectors.h"

namespace palpate {

/// Kind of surface feature at a contact point.
enum class FeatureKind : std::uint8_t { group, vertex, edge, face };

/// Packs an identifier, from the highest bits: tool (0 to 511), place on the tool (0 to 15), kind, and twice
/// 24 bits for the number of a group, a surface node or a simplex, or the two nodes of an edge. The same
/// feature of the surface and place on the tool have the same identifier.
constexpr std::int64_t contact_feature(Index tool, int place, FeatureKind kind, Index a,
                                       Index b = 0) noexcept {
  const std::int64_t head = (std::int64_t{tool} * 16 + place) * 4 + static_cast<int>(kind);
  const Index low = kind == FeatureKind::edge ? std::min(a, b) : 0;
  const Index high = kind == FeatureKind::edge ? std::max(a, b) : a;
  return (head << 48) + (std::int64_t{low} << 24) + high;
}

/// Returns the kind of a feature.
constexpr FeatureKind kind_of(std::int64_t feature) noexcept {
  return static_cast<FeatureKind>((feature >> 48) & 3);
}

/// True if two features have the same tool, place on it and kind.
constexpr bool are_alike(std::int64_t a, std::int64_t b) noexcept {
  return a >> 48 == b >> 48;
}

/// Returns the feature of the same tool and place with another kind and number.
constexpr std::int64_t with_kind(std::int64_t feature, FeatureKind kind, Index number) noexcept {
  const std::int64_t head = (feature >> 48) / 4 * 4 + static_cast<int>(kind);
  return (head << 48) + number;
}

}  // namespace palpate
