#include "base/error.h"

#include <cctype>

#include "base/printable.h"

namespace palpate {

std::string to_text(const Error& error) {
  std::string hint = error.hint();
  // Not where it begins with a name, such as edge_length or --jobs.
  const std::string first_word = hint.substr(0, hint.find(' '));
  if (first_word.find_first_of("_./-=") == std::string::npos && !hint.empty()) {
    hint[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(hint[0])));
  }
  if (!hint.empty() && std::isalnum(static_cast<unsigned char>(hint.back())) != 0) hint += '.';
  return "error: " + printable(error.where()) + ": " + printable_lines(error.what(), "  ") +
         "\nhint: " + printable_lines(hint) + "\n";
}

}  // namespace palpate
