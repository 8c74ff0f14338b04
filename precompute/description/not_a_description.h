// Files given in place of a model.toml.
#pragma once

#include <filesystem>

namespace palpate {

/// Throws Error for an existing file that is not a model.toml: for a surface, an image, a volume mesh or a
/// picture with a model.toml to start from; for a kind that is not read with the command that converts it
/// (formats/file_kinds.h); for an unknown kind; for a folder.
void check_is_description(const std::filesystem::path& path);

}  // namespace palpate
