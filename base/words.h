// Words of the messages about what somebody wrote.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// "a, b, c".
std::string comma_list(const std::vector<std::string_view>& words);

/// At most `most` bytes of what a file says, for a message: "..." stands for the rest.
std::string shortened(std::string_view text, std::size_t most = 60);

/// The shortest text that reads back as the same number, whatever the locale.
std::string shown(double value);

/// A text as an attribute of XML in double quotes, or what stands between elements.
std::string xml_escaped(std::string_view text);

}  // namespace palpate
