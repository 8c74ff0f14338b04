// Files that the programs of one user share and nobody else can open.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace palpate {

/// palpate/NAME in $XDG_RUNTIME_DIR, without that in $XDG_STATE_HOME, without that in ~/.local/state. Throws
/// Error where none of them is set.
[[nodiscard]] std::filesystem::path private_file(const std::string& name);

/// Makes a folder for this user alone (mode 0700). Throws Error where that fails, or where the folder is
/// there and others may write in it.
void make_private_folder(const std::filesystem::path& folder);

/// Writes a file that only this user can read (mode 0600), and its private folder.
void write_private_file(const std::filesystem::path& file, std::string_view text);

/// Empty where there is nothing, or where others could have read or written it.
[[nodiscard]] std::string read_private_file(const std::filesystem::path& file);

}  // namespace palpate
