// The command line of palpate-precompute-mpi.
#pragma once

#include "precompute/team.h"

namespace palpate {

/// Does what the command line says by the processes of `team` and returns the exit status. All call it; the
/// leader alone prints. Throws Error.
int run_rank_commands(int argc, char** argv, Team& team);

}  // namespace palpate
