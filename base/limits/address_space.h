// Address space, and its limit (ulimit -v).
#pragma once

#include <cstdint>
#include <optional>

namespace palpate {

/// Address space of this process [byte]; 0 if unknown.
std::int64_t address_space();

/// Address space that this process may still take [byte]; nullopt if unlimited.
std::optional<std::int64_t> address_room();

}  // namespace palpate
