// Files that only the programs of one user can open.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace palpate {

/// $XDG_RUNTIME_DIR/palpate/NAME; without that variable below $XDG_STATE_HOME, else below ~/.local/state.
/// Throws Error if none of them is set.
[[nodiscard]] std::filesystem::path private_file(const std::string& name);

/// Creates a folder for this user alone (mode 0700). Throws Error if that fails, or if the folder exists and
/// others may write to it.
void make_private_folder(const std::filesystem::path& folder);

/// Writes a file that only this user can read (mode 0600) and creates its private folder.
void write_private_file(const std::filesystem::path& file, std::string_view text);

/// Content of the file; empty if there is none, or if others could have read or written it.
[[nodiscard]] std::string read_private_file(const std::filesystem::path& file);

}  // namespace palpate
