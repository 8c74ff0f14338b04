// What a factor over several processes takes.
#pragma once

#include <string>

#include "precompute/numerics/factor.h"
#include "precompute/plan.h"
#include "precompute/team.h"

namespace palpate {

/// What one of so many processes would need for its part of a factor, before there are that many.
SpreadMemory expected_spread_memory(const Factor& factor, int ranks);

/// Makes a plan one of processes that share a factor and solve for each block of columns together. K has so
/// many entries.
void spread_plan(const SpreadMemory& memory, std::int64_t entries, int ranks, int jobs, Plan& plan);

/// "0.40 GB of memory in the rank with most, 1.20 GB in all", as expected or as used.
std::string text_of(const SpreadMemory& memory, bool used);

/// Whether a plan needs more memory than this process is given, of so many on this machine.
bool needs_more_memory(const Plan& plan, int ranks_here);

/// Hands the numbers of a factor of K to the processes, as those of `first` are.
void spread_likewise(const Factor& first, const SparseMatrix& K, Team& team, int jobs, Factor& factor);

}  // namespace palpate
