// `palpate-runtime push`: its arguments, and palpate-precompute as its first step.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "runtime/serving/viewer_port.h"

namespace palpate {

/// Arguments as given on the command line.
struct PushArguments {
  std::string file;
  std::vector<std::string> for_precompute;  ///< options passed on to it, with their values
  std::optional<std::string> duration;
  ViewerArguments viewer;  ///< options added by the caller
};

/// Adds the subcommand.
CLI::App* add_push(CLI::App& app, PushArguments& arguments);

/// True if the file is baked already, by its name. Throws CLI::ParseError if it is and options for baking are
/// given.
[[nodiscard]] bool is_baked(const PushArguments& arguments);

/// Result of a bake.
struct Baked {
  int status = 0;    ///< exit status of palpate-precompute, which has printed the error
  std::string file;  ///< written, or already up to date
};

/// Bakes the file by palpate-precompute, in a process of its own, unless it is baked already. Throws Error if
/// the program is missing or does not name its output.
[[nodiscard]] Baked bake_first(const PushArguments& arguments);

}  // namespace palpate
