// `palpate-runtime push`: its arguments, and palpate-precompute as its first step.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "runtime/serving/viewer_port.h"

namespace palpate {

/// As they were written.
struct PushArguments {
  std::string file;
  std::vector<std::string> for_precompute;  ///< options that are handed on, with their values
  std::optional<std::string> duration;
  ViewerArguments viewer;  ///< of options that the caller adds
};

/// Adds the subcommand.
CLI::App* add_push(CLI::App& app, PushArguments& arguments);

/// Whether the file is baked already, by its name. Throws CLI::ParseError where it is and options are given
/// that only a bake has a use for.
[[nodiscard]] bool is_baked(const PushArguments& arguments);

/// What came of a bake.
struct Baked {
  int status = 0;    ///< exit status of palpate-precompute, which has told what was wrong
  std::string file;  ///< that was written, or was there already and up to date
};

/// Bakes by palpate-precompute, in a process of its own, what is not baked yet. Throws Error where the
/// program is not there or does not say what it wrote.
[[nodiscard]] Baked bake_first(const PushArguments& arguments);

}  // namespace palpate
