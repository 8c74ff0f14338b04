// Files that are given in the place of a model.toml.
#pragma once

#include <filesystem>

namespace palpate {

/// Throws Error for a file that exists and is, by its name, something else than a model.toml: a surface, an
/// image, a volume mesh or a picture, of which it shows a model.toml to begin with; a baked model or a
/// recording, for which it names the command; a folder.
void check_is_description(const std::filesystem::path& path);

}  // namespace palpate
