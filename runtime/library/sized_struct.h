// Structs of palpate.h from programs compiled with an older or newer version of it. A new member must be
// added at the end of its struct and must make it larger; padding does not count.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <optional>

namespace palpate {

constexpr std::size_t largest_struct = 4096;  // [bytes] a larger size was never initialised

/// True if a version of `Struct` can have this size: `size`, at least one more member, and no member cut.
template <typename Struct>
constexpr bool is_size_of(std::size_t size) noexcept {
  return size > sizeof(std::size_t) && size <= largest_struct && size % alignof(Struct) == 0;
}

/// Reads element `k` of an array whose first element gives the size of all. Members that it lacks are taken
/// from `defaults`. Empty if the pointer is null, the size is invalid or differs from the first one's, or a
/// member unknown to this version is set (the rule of Linux's copy_struct_from_user).
template <typename Struct>
std::optional<Struct> read_struct(const Struct* first, std::size_t k, const Struct& defaults) noexcept {
  if (first == nullptr) return std::nullopt;
  const std::size_t size = first->size;
  if (!is_size_of<Struct>(size)) return std::nullopt;
  const auto* given = reinterpret_cast<const std::byte*>(first) + k * size;
  const auto known = given + std::min(size, sizeof(Struct));
  if (std::any_of(known, given + size, [](std::byte byte) { return byte != std::byte{0}; }))
    return std::nullopt;
  Struct result = defaults;
  std::memcpy(&result, given, std::min(size, sizeof(Struct)));
  if (result.size != size) return std::nullopt;
  return result;
}

/// Writes the members that the caller's struct has, element `k` of an array whose first element gives the
/// size of all; members unknown to this version become 0. False, and nothing is written, if the pointer is
/// null or the size is invalid.
template <typename Struct>
bool write_struct(Struct from, Struct* first, std::size_t k = 0) noexcept {
  if (first == nullptr) return false;
  const std::size_t size = first->size;
  if (!is_size_of<Struct>(size)) return false;
  from.size = size;
  std::byte* bytes = reinterpret_cast<std::byte*>(first) + k * size;
  std::memcpy(bytes, &from, std::min(size, sizeof(Struct)));
  std::fill(bytes + std::min(size, sizeof(Struct)), bytes + size, std::byte{0});
  return true;
}

}  // namespace palpate
