// Files that are given in the place of a model.toml.
#pragma once

#include <filesystem>

namespace palpate {

/// Throws Error for a file that exists and is something else than a model.toml: a surface, an image, a volume
/// mesh or a picture, of which it shows a model.toml to begin with; a kind that is not read, with the command
/// that makes one that is (formats/file_kinds.h); an unknown one; a folder.
void check_is_description(const std::filesystem::path& path);

}  // namespace palpate
