// Command line of palpate-precompute for a surface or an image.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "precompute/draft/draft.h"

namespace palpate {

/// Arguments as typed.
struct DraftArguments {
  std::string unit;
  std::string parts;
  std::string range;
  std::string element;
  bool strict = false;
  bool renew = false;
  std::optional<int> nodes{};

  [[nodiscard]] bool given() const;  ///< true if any of them applies to new descriptions only
};

/// Adds the options of a draft.
void add_draft_options(CLI::App& app, DraftArguments& arguments);

/// Adds the command `new`, which asks for the `file` if it is not given.
CLI::App* add_new(CLI::App& app, std::string& file, DraftArguments& arguments);

/// Throws CLI::ParseError if they are given for anything but a surface or an image.
void check_draft_options(const std::string& model, const DraftArguments& arguments);

/// Description of `model`: itself or, for a surface or an image, the one drafted beside it, with each
/// decision printed on the error stream; with `keep` no existing file is replaced. If the folder of `model`
/// is read-only, it is drafted beside the `output`. Throws Error.
std::string described(const std::string& model, const DraftArguments& arguments, bool keep,
                      const std::filesystem::path& output);

/// Runs `new`: asks on the terminal or takes answers from a pipe, and prints the next step. Returns the exit
/// status; throws Error.
int run_new(const std::string& file, const DraftArguments& arguments);

}  // namespace palpate
