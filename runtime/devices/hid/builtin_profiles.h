// The profiles that palpate-runtime has in itself.
#pragma once

#include <span>
#include <string_view>

namespace palpate {

/// A file of runtime/devices/hid/profiles, as it was when the program was built.
struct BuiltinProfile {
  std::string_view name;  ///< of the file, without .toml
  std::string_view text;
};

/// All of them, by name.
[[nodiscard]] std::span<const BuiltinProfile> builtin_profiles() noexcept;

}  // namespace palpate
