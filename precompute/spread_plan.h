// The memory of a factor over several processes, and columns that are solved with it.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "precompute/numerics/factor.h"
#include "precompute/plan.h"
#include "precompute/team.h"

namespace palpate {

/// What one of so many processes would need for its part of a factor, before there are that many.
SpreadMemory expected_spread_memory(const Factor& factor, int ranks);

/// Makes a plan one of processes that share a factor, with which the leader solves. K has so many entries.
void spread_plan(const SpreadMemory& memory, std::int64_t entries, int ranks, int jobs, Plan& plan);

/// "0.40 GB of memory in the rank with most, 1.20 GB in all", as expected or as used.
std::string text_of(const SpreadMemory& memory, bool used);

/// Whether a plan needs more memory than this process is given, of so many on this machine.
bool needs_more_memory(const Plan& plan, int ranks_here);

/// Hands the numbers of a factor of K to the processes, as those of `first` are.
void spread_likewise(const Factor& first, const SparseMatrix& K, Team& team, int jobs, Factor& factor);

/// Work of the leader, which is given who interrupts it. False when it was interrupted.
using LeadersWork = std::function<bool(const std::function<bool()>& interrupted)>;

/// The leader works, and the others help it to solve until it is done. False, in all, when one was
/// interrupted.
bool work_while_others_serve(SpreadNumbers& numbers, Team& team, const std::function<bool()>& interrupted,
                             const LeadersWork& work);

/// Columns [first, first + count) of the lower triangle of K^-1 restricted to `dofs` [rows], -1 where a row
/// is held: one after the other, each from its diagonal down, to `packed` (resized). In the leader, while the
/// others serve.
void spread_columns(SpreadNumbers& numbers, std::span<const std::int64_t> dofs, std::int64_t first,
                    std::int64_t count, std::vector<double>& packed);

}  // namespace palpate
