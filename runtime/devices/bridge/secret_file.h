// Secrets that the programs of one user share by files that nobody else can read.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace palpate {

/// palpate/NAME in $XDG_RUNTIME_DIR, without that in $XDG_STATE_HOME, without that in ~/.local/state. Throws
/// Error where none of them is set.
[[nodiscard]] std::filesystem::path secret_file(const std::string& name);

/// Writes it for this user's eyes alone (mode 0600), in the place of what was there; makes the folder (0700).
/// Throws Error where that fails, or where others may write in the folder.
void write_secret(const std::filesystem::path& file, std::string_view text);

/// What was written; empty where there is nothing, or where others could have read or written it.
[[nodiscard]] std::string read_secret(const std::filesystem::path& file);

}  // namespace palpate
