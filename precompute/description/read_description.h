// Reader of model.toml.
#pragma once

#include <filesystem>
#include <string>

#include "precompute/description/description.h"

namespace palpate {

/// Reads and checks model.toml. Relative files are relative to its folder. Throws Error with file, line and
/// column; for an unknown key with the nearest known one.
Description read_description(const std::filesystem::path& file);

/// Reads a description from a text, such as one stored in a baked file, instead of from `file`.
Description parse_description(const std::string& text, const std::filesystem::path& file);

}  // namespace palpate
