// SHA-256 (FIPS 180-4), which browsers provide too.
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace palpate {

[[nodiscard]] std::array<std::uint8_t, 32> sha256(std::string text);

}  // namespace palpate
