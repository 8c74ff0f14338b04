// Memory of a factor distributed over several processes, and columns solved with it.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "precompute/bake_run.h"
#include "precompute/numerics/factor.h"

namespace palpate {

/// Memory that each of `ranks` processes would need for its part of a factor; for planning.
SpreadMemory expected_spread_memory(const Factor& factor, int ranks);

/// Adapts a plan to processes that hold a factor together, with which the leader solves. K has so many
/// entries.
void spread_plan(const SpreadMemory& memory, std::int64_t entries, int ranks, int jobs, Plan& plan);

/// Memory in words, expected or used: "0.40 GB of memory in the rank with most, 1.20 GB in all".
std::string text_of(const SpreadMemory& memory, bool used);

/// True if a plan needs more memory than this process may use, with so many processes on this machine.
bool needs_more_memory(const Plan& plan, int ranks_here);

/// The leader works alone, with one thread and the requests of all to stop, and the others help it to solve
/// until it is done. False, in all, when one was interrupted.
bool work_while_others_serve(SpreadNumbers& numbers, const BakeRun& run,
                             const std::function<bool(const BakeRun& leader)>& work);

/// Columns [first, first + count) of the lower triangle of K^-1 restricted to `dofs` [rows], -1 for held
/// rows: one after the other, each from its diagonal down, to `packed` (resized). In the leader, while the
/// others serve.
void spread_columns(SpreadNumbers& numbers, std::span<const std::int64_t> dofs, std::int64_t first,
                    std::int64_t count, std::vector<double>& packed);

}  // namespace palpate
