// Entries in single precision that a hierarchical matrix shares.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>

namespace palpate {

/// The place i of an array, which is not negative.
inline std::size_t at(std::int64_t i) noexcept {
  return static_cast<std::size_t>(i);
}

/// Room for `count` entries, of one at least; not set.
inline std::shared_ptr<float[]> floats(std::int64_t count) {
  return std::shared_ptr<float[]>(new float[at(std::max<std::int64_t>(count, 1))]);
}

}  // namespace palpate
