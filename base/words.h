// Words and numbers as messages show them.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// Words joined by commas: "a, b, c".
std::string comma_list(const std::vector<std::string_view>& words);

/// At most `most` bytes of a file's text, for a message; "..." stands for the rest.
std::string shortened(std::string_view text, std::size_t most = 60);

/// Shortest text that reads back as the same number, independent of the locale.
std::string shown(double value);

/// A text escaped for XML, as an attribute in double quotes or as character data.
std::string xml_escaped(std::string_view text);

}  // namespace palpate
