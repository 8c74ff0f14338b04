// Single precision entries of a hierarchical matrix.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>

namespace palpate {

/// Position i, not negative, of an array.
inline std::size_t at(std::int64_t i) noexcept {
  return static_cast<std::size_t>(i);
}

/// Uninitialised memory for `count` entries, at least one.
inline std::shared_ptr<float[]> floats(std::int64_t count) {
  return std::shared_ptr<float[]>(new float[at(std::max<std::int64_t>(count, 1))]);
}

}  // namespace palpate
