// A program's command line as data, from which scripts/reference makes manual pages, completions and
// reference.
#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace palpate {

/// All arguments of a command; those of its groups come last.
[[nodiscard]] std::vector<const CLI::Option*> arguments_of(const CLI::App& app);

/// Names of an option as typed, "-o" and "--output"; none for a positional argument.
[[nodiscard]] std::vector<std::string> option_names(const CLI::Option& option);

/// A command or a whole program: its texts, arguments and commands, in the order of its help.
[[nodiscard]] nlohmann::ordered_json help_json(const CLI::App& app);

}  // namespace palpate
