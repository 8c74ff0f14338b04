// The command line of palpate-precompute, and what that of its ranks shares with it.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "precompute/bake.h"
#include "precompute/team.h"

namespace palpate {

/// Does what the command line says, and returns the exit status. Throws Error.
int run_commands(int argc, char** argv);

/// Adds the options of a bake, of one machine or of ranks.
void add_bake_options(CLI::App& app, BakeOptions& options);

/// Bakes a description's file. The defaults of output and jobs are filled in. Throws Error.
BakeSummary bake_model(const std::string& model, BakeOptions options, Team& team);

/// What a person may do next, lines.
std::string next_steps(const BakeSummary& bake);

}  // namespace palpate
