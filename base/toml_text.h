// Parsing and writing of TOML from untrusted files.
#pragma once

#include <toml++/toml.h>

#include <string>
#include <string_view>

namespace palpate {

/// Parses a TOML text; `file` is its name in messages. Throws Error with file, line and column for invalid
/// TOML and, before the parser runs, for input that would overflow its stack or take it forever: more than 16
/// MB, keys of more than 16 dotted parts, values nested more than 32 deep, more than 50 000 tables or dots in
/// keys.
toml::table parse_toml(std::string_view text, const std::string& file);

/// A text as a TOML basic string: quoted, with control characters, quotes and backslashes escaped.
std::string toml_string(std::string_view text);

}  // namespace palpate
