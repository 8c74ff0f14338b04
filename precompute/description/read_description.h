// model.toml, read and checked.
#pragma once

#include <filesystem>
#include <string>

#include "precompute/description/description.h"

namespace palpate {

/// Reads and checks model.toml. Relative files are taken from its folder. Throws Error with file, line and
/// column; an unknown key names the nearest known one.
Description read_description(const std::filesystem::path& file);

/// Reads a description from its text, such as one stored in a baked file, in place of `file`.
Description parse_description(const std::string& text, const std::filesystem::path& file);

}  // namespace palpate
