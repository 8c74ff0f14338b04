// Structs of palpate.h given by programs that were compiled with an older or newer version of it. A member
// that is added there goes to the end of its struct and must make it larger: padding has no size of its own.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <optional>

namespace palpate {

constexpr std::size_t largest_struct = 4096;  // [bytes] whatever is larger was never set

/// Whether a version of `Struct` can have this size: its `size`, at least one member, and no member cut.
template <typename Struct>
constexpr bool is_size_of(std::size_t size) noexcept {
  return size > sizeof(std::size_t) && size <= largest_struct && size % alignof(Struct) == 0;
}

/// Element `k` of an array whose first element tells the size of them all. Members that it lacks are those of
/// `defaults`. Nothing where it is null, the size cannot be, is another than the first one's, or a member
/// that is not known here is set (the rule of Linux's copy_struct_from_user).
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

/// Gives the caller the members that its struct has, element `k` of an array whose first element tells the
/// size of them all; those that are not known here become 0. False, with nothing written, where it is null or
/// its size cannot be.
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
