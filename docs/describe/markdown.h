// Tables in Markdown.
#pragma once

#include <string>
#include <vector>

namespace palpate {

/// A cell as a table can hold it: on one line, with its bars escaped.
[[nodiscard]] std::string cell(const std::string& text);

/// As code, empty where the text is.
[[nodiscard]] std::string code(const std::string& text);

/// The text with options such as --fast as code, whose dashes would else become one long one.
[[nodiscard]] std::string with_options_as_code(const std::string& text);

/// A table with a line of titles, ended by an empty line. Columns that are empty in all rows are left out.
[[nodiscard]] std::string markdown_table(const std::vector<std::string>& titles,
                                         const std::vector<std::vector<std::string>>& rows);

/// The text with its paragraphs broken after at most 110 bytes where there are spaces; tables and headings
/// stay. It ends in one line feed.
[[nodiscard]] std::string with_short_lines(const std::string& text);

}  // namespace palpate
