// Baking: from a description to NAME.palpate.hdf.
#pragma once

#include "precompute/bake_run.h"

namespace palpate {

/// Runs the whole precomputation: mesh, K, factor, columns, file. Prints progress to standard error. On
/// Ctrl-C, SIGTERM or SIGUSR1 it stops after the current block of columns; the next run of the same model
/// continues from the finished columns. Throws Error for bad input, and with the numbers if memory or disk
/// space is insufficient.
BakeResult bake(const Description& description, const BakeOptions& options);

/// Runs the precomputation together with other processes, which call this too. They divide columns,
/// compression and overlays among them; each computes everything else before the columns; only the leader
/// prints and writes the rest.
BakeSummary bake(const Description& description, const BakeOptions& options, Team& team);

}  // namespace palpate
