// TOML from files of unknown origin.
#pragma once

#include <toml++/toml.h>

#include <string>
#include <string_view>

namespace palpate {

/// Parses a TOML text; `file` is its name in messages. Throws Error with file, line and column for what is
/// not valid TOML, and before the parser sees it for what would overflow its stack or take it for ever: more
/// than 16 MB, keys of more than 16 dotted parts, values nested more than 32 deep, more than 50 000 tables or
/// dots in keys.
toml::table parse_toml(std::string_view text, const std::string& file);

/// A text as a basic string of TOML: in quotes, with control characters, quotes and backslashes escaped.
std::string toml_string(std::string_view text);

}  // namespace palpate
