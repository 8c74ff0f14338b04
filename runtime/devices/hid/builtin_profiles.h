// Device profiles built into palpate-runtime.
#pragma once

#include <span>
#include <string_view>

namespace palpate {

/// File of runtime/devices/hid/profiles at build time.
struct BuiltinProfile {
  std::string_view name;  ///< file name without .toml
  std::string_view text;
};

/// Returns all built-in profiles, sorted by name.
[[nodiscard]] std::span<const BuiltinProfile> builtin_profiles() noexcept;

}  // namespace palpate
