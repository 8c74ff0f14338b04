// Command line of palpate-precompute, and the parts that its ranks use too.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "precompute/bake.h"
#include "precompute/team.h"

namespace palpate {

/// Runs the command line and returns the exit status. Throws Error.
int run_commands(int argc, char** argv);

/// Adds the options of a bake, for one machine or for ranks.
void add_bake_options(CLI::App& app, BakeOptions& options);

/// Bakes a description's file. Fills in the defaults of output and jobs. Throws Error.
BakeSummary bake_model(const std::string& model, BakeOptions options, Team& team);

/// Suggested next commands, as lines.
std::string next_steps(const BakeSummary& bake);

}  // namespace palpate
