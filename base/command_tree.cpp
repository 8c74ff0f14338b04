#include "base/command_tree.h"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <utility>

namespace palpate {
namespace {

/// What is written for the value of an option.
std::string value_of(const CLI::Option& option) {
  if (!option.get_option_text().empty()) return option.get_option_text();
  return option.get_type_size() == 0 ? "" : option.get_type_name();
}

ArgumentText argument_text(const CLI::Option& option) {
  ArgumentText text;
  if (option.nonpositional()) {
    for (const std::string& name : option.get_snames()) text.names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) text.names.push_back("--" + name);
    text.value = value_of(option);
    text.otherwise = option.get_default_str();
  } else {
    text.names.push_back(option.get_name(true, false));
  }
  text.meaning = option.get_description();
  text.group = option.get_group() == "Options" ? "" : option.get_group();
  text.is_required = option.get_required();
  text.is_repeatable = option.get_expected_max() >= CLI::detail::expected_max_vector_size;
  return text;
}

bool is_word(char letter) {
  const auto byte = static_cast<unsigned char>(letter);
  return std::islower(byte) != 0 || std::isdigit(byte) != 0 || letter == '-';
}

/// The pattern of a file that a name in capitals stands for, "" for what is none.
std::string pattern_of(std::string_view placeholder) {
  if (placeholder == "FILE") return "*";
  const std::size_t dot = placeholder.find('.');
  return dot == std::string_view::npos ? "" : "*" + std::string(placeholder.substr(dot));
}

ValueChoice choice_of(std::string_view text) {
  const auto end = std::ranges::find_if_not(text, is_word);
  const auto length = static_cast<std::size_t>(end - text.begin());
  const std::string word(text.substr(0, length));
  const std::string_view rest = text.substr(length);
  if (word.empty()) return {.word = "", .file_pattern = pattern_of(rest)};
  if (rest.empty() || rest.front() == '[') return {.word = word, .file_pattern = ""};
  return {.word = word + rest.front(), .file_pattern = pattern_of(rest.substr(1))};
}

/// The parts between bars that stand in no brackets.
std::vector<std::string_view> alternatives(std::string_view value) {
  std::vector<std::string_view> parts;
  std::size_t begin = 0;
  int depth = 0;
  for (std::size_t at = 0; at <= value.size(); ++at) {
    const char letter = at < value.size() ? value[at] : '|';
    depth += letter == '[' ? 1 : letter == ']' ? -1 : 0;
    if (letter != '|' || depth > 0) continue;
    parts.push_back(value.substr(begin, at - begin));
    begin = at + 1;
  }
  return parts;
}

/// Endings of files that a meaning lists: ".stl" and ".off" of "a surface (.stl, .off)".
std::vector<std::string> endings_in(const std::string& meaning) {
  std::vector<std::string> endings;
  for (std::size_t at = meaning.find('.'); at != std::string::npos; at = meaning.find('.', at + 1)) {
    if (at == 0 || (meaning[at - 1] != '(' && meaning[at - 1] != ' ')) continue;
    const std::size_t end = meaning.find_first_of(" ,;)", at);
    endings.push_back(meaning.substr(at, end - at));
  }
  return endings;
}

}  // namespace

CommandText command_tree(const CLI::App& app) {
  CommandText text{.name = app.get_name(),
                   .meaning = app.get_description(),
                   .footer = app.get_footer(),
                   .positionals = {},
                   .options = {},
                   .commands = {}};
  for (const CLI::Option* option : app.get_options())
    (option->nonpositional() ? text.options : text.positionals).push_back(argument_text(*option));
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    CommandText inner = command_tree(*command);
    if (command->get_name().empty()) {  // a group of options
      std::ranges::copy_if(inner.options, std::back_inserter(text.options), [](const ArgumentText& option) {
        return option.names.back() != "--help";  // each group has one of its own
      });
    } else {
      text.commands.push_back(std::move(inner));
    }
  }
  return text;
}

std::vector<ValueChoice> value_choices(std::string_view value) {
  std::vector<ValueChoice> choices;
  for (const std::string_view part : alternatives(value)) {
    ValueChoice choice = choice_of(part);
    if (!choice.word.empty() || !choice.file_pattern.empty()) choices.push_back(std::move(choice));
  }
  return choices;
}

std::vector<ValueChoice> positional_choices(const ArgumentText& argument) {
  const std::string name = argument.names.front();
  std::vector<ValueChoice> choices;
  const std::string file = "NAME.palpate";
  const std::size_t at = argument.meaning.find(file);
  if (name.find('.') != std::string::npos) {
    choices.push_back({.word = "", .file_pattern = pattern_of(name)});
  } else if (at != std::string::npos) {
    const std::size_t end = argument.meaning.find_first_of(" ,;", at);
    choices.push_back({.word = "", .file_pattern = pattern_of(argument.meaning.substr(at, end - at))});
  }
  for (const std::string& ending : endings_in(argument.meaning))
    choices.push_back({.word = "", .file_pattern = "*" + ending});
  return choices;
}

}  // namespace palpate
