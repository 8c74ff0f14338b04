// Random bits of the kernel, for secrets.
#pragma once

#include <sys/random.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <system_error>

#include "base/error.h"

namespace palpate {

/// Bytes that nobody can guess. Throws Error where the kernel has none.
template <std::size_t count>
[[nodiscard]] std::array<std::uint8_t, count> random_bytes() {
  std::array<std::uint8_t, count> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw Error("no random numbers: " + std::system_category().message(errno), "getrandom",
                "see why the kernel has none");
  }
  return bytes;
}

}  // namespace palpate
