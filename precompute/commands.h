// The command line of palpate-precompute.
#pragma once

#include "precompute/team.h"

namespace palpate {

/// Does what the command line says, a bake by the processes of `team`, and returns the exit status. Throws
/// Error.
int run_commands(int argc, char** argv, Team& team);

}  // namespace palpate
