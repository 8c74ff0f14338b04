// Address space, and its limit (ulimit -v).
#pragma once

#include <cstdint>
#include <optional>

namespace palpate {

/// Address space that this process has [byte]; 0 when the system does not say.
std::int64_t address_space();

/// Address space that this process may still take [byte]; nothing where it is not limited.
std::optional<std::int64_t> address_room();

}  // namespace palpate
