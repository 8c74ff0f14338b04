// Numbers in reports: little-endian, two's complement.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace palpate {

/// Reads the number at byte `at`; the caller ensures that the bytes exist.
template <class Number>
[[nodiscard]] constexpr Number read_number(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  std::make_unsigned_t<Number> value = 0;
  for (std::size_t i = 0; i < sizeof(Number); ++i) {
    value = static_cast<decltype(value)>(value | static_cast<decltype(value)>(bytes[at + i]) << (8 * i));
  }
  return static_cast<Number>(value);
}

/// Writes the number at byte `at`; the caller ensures that the bytes exist.
template <class Number>
constexpr void write_number(std::span<std::uint8_t> bytes, std::size_t at, Number number) noexcept {
  const auto value = static_cast<std::make_unsigned_t<Number>>(number);
  for (std::size_t i = 0; i < sizeof(Number); ++i) {
    bytes[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
  }
}

}  // namespace palpate
