// Command line of palpate-precompute-mpi.
#pragma once

#include "precompute/team.h"

namespace palpate {

/// Runs the command line on the processes of `team` and returns the exit status. All processes call it; only
/// the leader prints. Throws Error.
int run_rank_commands(int argc, char** argv, Team& team);

}  // namespace palpate
