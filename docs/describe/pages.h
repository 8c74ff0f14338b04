// The pages of the book's reference, made from the tables of the code.
#pragma once

#include <string>
#include <vector>

namespace palpate {

/// A page in Markdown.
struct Page {
  std::string name;  ///< of the file, without ".md"
  std::string text;
};

// All throw Error where a table and what is said of its rows do not belong together.

[[nodiscard]] Page model_keys_page();
[[nodiscard]] Page play_options_page();
[[nodiscard]] Page safety_bounds_page();
[[nodiscard]] Page file_fields_page();
[[nodiscard]] Page recording_fields_page();
[[nodiscard]] Page status_bits_page();
[[nodiscard]] Page tuning_page();
[[nodiscard]] Page exit_statuses_page();

/// Every page as its file has it: paragraphs in lines of bearable width, and who wrote it.
[[nodiscard]] std::vector<Page> reference_pages();

}  // namespace palpate
