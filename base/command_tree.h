// A program's command line as data, for pages and completions that are made from it.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// An option, a flag or a positional argument.
struct ArgumentText {
  std::vector<std::string> names;  ///< as they are typed: "-o", "--output"; "FILE" of a positional argument
  std::string value;               ///< what is written for it; "" for flags and positional arguments
  std::string otherwise;           ///< its default, where the option shows one
  std::string meaning;
  std::string group;  ///< heading of its group, "" for none
  bool is_required = false;
  bool is_repeatable = false;
};

/// A command, or the program itself.
struct CommandText {
  std::string name;
  std::string meaning;
  std::string footer;
  std::vector<ArgumentText> positionals;
  std::vector<ArgumentText> options;
  std::vector<CommandText> commands;
};

/// All of a program: its commands, options and texts, in the order of its help.
[[nodiscard]] CommandText command_tree(const CLI::App& app);

/// One of the things that may be written for a value.
struct ValueChoice {
  std::string word;          ///< a word, or what it begins with: "dynamic", "sphere:"; "" for files alone
  std::string file_pattern;  ///< "*.csv" or "*" where the name of a file follows, else ""
};

/// Choices in a value as help shows it, such as "script:TOUCH.csv|hid[:WHICH]|mouse": words in small letters
/// are themselves, words in capitals stand for something, which is a file where they have a suffix or are
/// "FILE".
[[nodiscard]] std::vector<ValueChoice> value_choices(std::string_view value);

/// Choices of a positional argument, from its name or from the file and the endings of files that its meaning
/// names: "NAME.palpate.hdf", "(.stl, .off)".
[[nodiscard]] std::vector<ValueChoice> positional_choices(const ArgumentText& argument);

}  // namespace palpate
