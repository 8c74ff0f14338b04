// Parts common to both programs' command lines.
#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/help_json.h"
#include "base/json_text.h"
#include "base/spelling.h"

namespace palpate {

/// Help pages: descriptions wrapped beside the options, options under the headings of their groups in the
/// order in which they were added, those without a group last.
class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter() {
    label("Positionals", "Arguments");
    label("SUBCOMMAND", "COMMAND");
    label("REQUIRED", "(required)");
  }

  [[nodiscard]] std::string make_description(const CLI::App* app) const override {
    return wrapped(app->get_description(), 0) + "\n";
  }

  [[nodiscard]] std::string make_help(const CLI::App* app, std::string name,
                                      CLI::AppFormatMode mode) const override {
    return make_description(app) + make_usage(app, std::move(name)) + make_positionals(app) +
           all_groups(app) + make_subcommands(app, mode) + "\n" + make_footer(app);
  }

  [[nodiscard]] std::string make_option(const CLI::Option* option, bool is_positional) const override {
    return entry(make_option_name(option, is_positional) + make_option_opts(option),
                 make_option_desc(option));
  }

  [[nodiscard]] std::string make_subcommand(const CLI::App* command) const override {
    return entry(command->get_display_name(true), command->get_description());
  }

 private:
  [[nodiscard]] std::string all_groups(const CLI::App* app) const {
    std::string text, rest;
    for (const std::string& group : app->get_groups()) {
      const std::vector<const CLI::Option*> options = app->get_options(
          [&](const CLI::Option* option) { return option->get_group() == group && option->nonpositional(); });
      if (group.empty() || options.empty()) continue;
      (group == "Options" ? rest : text) += make_group(group, false, options);
    }
    return text + rest;
  }

  static constexpr std::size_t width = 100, column = 30;

  /// Breaks lines between words and indents all but the first.
  [[nodiscard]] static std::string wrapped(const std::string& text, std::size_t indent) {
    std::string result;
    std::size_t at = indent;
    for (std::size_t begin = 0; begin < text.size();) {
      const std::size_t end = std::min(text.find(' ', begin), text.size());
      const std::size_t length = end - begin;
      if (at > indent && at + 1 + length > width) {
        result += "\n" + std::string(indent, ' ');
        at = indent;
      } else if (at > indent) {
        result += ' ';
        ++at;
      }
      result.append(text, begin, length);
      at += length;
      begin = end + 1;
    }
    return result;
  }

  [[nodiscard]] static std::string entry(const std::string& name, const std::string& description) {
    std::string line = "  " + name;
    line +=
        line.size() + 2 > column ? "\n" + std::string(column, ' ') : std::string(column - line.size(), ' ');
    return line + wrapped(description, column) + "\n";
  }
};

/// Refuses an empty word as any value: no name, path or number is empty.
inline void refuse_empty_values(CLI::App& app) {
  for (CLI::Option* option :
       app.get_options([](const CLI::Option* each) { return each->get_expected_max() > 0; })) {
    option->check(
        [](const std::string& value) { return value.empty() ? "an empty word is no value" : std::string(); });
  }
  for (CLI::App* command : app.get_subcommands([](CLI::App*) { return true; })) refuse_empty_values(*command);
}

/// Reads the command line. Throws CLI::ParseError.
inline void parse(CLI::App& app, int argc, char** argv) {
  refuse_empty_values(app);
  app.parse(argc, argv);
}

/// The command of this name, or null.
inline const CLI::App* find_command(const CLI::App& app, const std::string& name) {
  const auto commands =
      app.get_subcommands([&](const CLI::App* command) { return command->get_name() == name; });
  return commands.empty() ? nullptr : commands.front();
}

/// "Did you mean --device? " if an unknown option is probably a misspelling of a known one, else "".
inline std::string meant_option(const CLI::App& app, int argc, char** argv) {
  std::vector<std::string> names;
  for (const CLI::Option* option :
       arguments_of(app.get_subcommands().empty() ? app : *app.get_subcommands().front())) {
    for (std::string& name : option_names(*option)) names.push_back(std::move(name));
  }
  const std::vector<std::string_view> known(names.begin(), names.end());
  for (int k = 1; k < argc; ++k) {
    const std::string_view argument = argv[k], word = argument.substr(0, argument.find('='));
    if (!word.starts_with("--") || std::ranges::find(known, word) != known.end()) continue;
    if (const auto option = meant(word, known)) return "Did you mean " + *option + "? ";
  }
  return "";
}

/// Adds `help [COMMAND]`.
inline CLI::App* add_help_command(CLI::App& app, std::string& command) {
  CLI::App* help = app.add_subcommand("help", "print this page, or the page of a command");
  help->add_option("COMMAND", command, "the command to explain")->type_name("");
  for (CLI::App* each : app.get_subcommands([](CLI::App*) { return true; })) each->group("Commands");
  help->footer("Examples:\n  " + app.get_name() + " help help\n  " + app.get_name() +
               " --help=json    all commands and options as data");
  return help;
}

/// The page of a command, or of the program when it is empty. Throws CLI::ParseError for an unknown one.
inline std::string help_page(const CLI::App& app, const std::string& command) {
  const auto formatter = app.get_formatter();
  if (command.empty()) return formatter->make_help(&app, app.get_name(), CLI::AppFormatMode::Normal);
  const CLI::App* found = find_command(app, command);
  if (found == nullptr)
    throw CLI::ParseError("there is no command '" + command + "'", CLI::ExitCodes::ExtrasError);
  return formatter->make_help(found, app.get_name() + " " + command, CLI::AppFormatMode::Normal);
}

/// True if `--help=json` is the only argument.
inline bool asks_for_json(int argc, char** argv) {
  return argc == 2 && std::string_view(argv[1]) == "--help=json";
}

/// Prints `help_json` of a program together with its own tables, by name; returns exit_ok.
inline int print_help_json(const CLI::App& app, const nlohmann::ordered_json& tables) {
  nlohmann::ordered_json json = help_json(app);
  json["version"] = PALPATE_VERSION;
  json.update(tables);
  std::fputs(json_text(json, 1).c_str(), stdout);
  return exit_ok;
}

}  // namespace palpate
