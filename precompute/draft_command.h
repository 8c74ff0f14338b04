// What the command line of palpate-precompute says of a surface or an image.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "precompute/draft/draft.h"

namespace palpate {

/// As they were written.
struct DraftArguments {
  std::string unit;
  std::string parts;
  std::string range;
  std::string element;
  bool strict = false;
  bool renew = false;
  std::optional<int> nodes{};

  [[nodiscard]] bool given() const;  ///< any that is for a new description alone
};

/// Adds the options of a draft.
void add_draft_options(CLI::App& app, DraftArguments& arguments);

/// Adds `new`, which asks for a `file` that is not given.
CLI::App* add_new(CLI::App& app, std::string& file, DraftArguments& arguments);

/// Throws CLI::ParseError where they are given for something else than a surface or an image.
void check_draft_options(const std::string& model, const DraftArguments& arguments);

/// A description of `model`: itself, or where it is a surface or an image the one that is drafted beside it,
/// with each decision told on the error stream; with `keep` no file that is there is replaced. Where the
/// folder of `model` may only be read, it is drafted beside the `output`. Throws Error.
std::string described(const std::string& model, const DraftArguments& arguments, bool keep,
                      const std::filesystem::path& output);

/// `new`: asks on the terminal or takes answers from a pipe, and names the next step. Returns the exit
/// status; throws Error.
int run_new(const std::string& file, const DraftArguments& arguments);

}  // namespace palpate
