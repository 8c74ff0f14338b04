#include "precompute/spread_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "precompute/machine/allotment.h"

namespace palpate {
namespace {

constexpr std::int64_t scalar = sizeof(double);
// MUMPS with 30 % of work space, relative to the factor (measured on 1 to 8 ranks): fronts and contributions,
// buffers for each doubling of the ranks, and the largest rank relative to the mean.
constexpr double one_rank = 1.45, each_doubling = 0.3, uneven = 1.15;
constexpr double solve_efficiency = 0.5;     // of joint sweeps relative to those of a single process
constexpr double together_efficiency = 0.6;  // of joint factorisation
constexpr double paths = 1.5;                // loads are swept to the root and back through all of the factor
constexpr std::int64_t solution_copies = 3;  // of a block in the leader: gathered, by rows, by columns
constexpr std::int64_t touched_columns = 90;  // for a place that the precision is chosen by
constexpr std::int64_t touched_copies = 3;    // loads, residuals and solutions, all in long double

}  // namespace

SpreadMemory expected_spread_memory(const Factor& factor, int ranks) {
  SpreadMemory memory;
  const double all =
      static_cast<double>(factor.entries() * scalar) * (one_rank + each_doubling * std::log2(ranks));
  memory.expected_all = static_cast<std::int64_t>(all);
  memory.expected = static_cast<std::int64_t>(ranks > 1 ? uneven * all / ranks : all);
  return memory;
}

void spread_plan(const SpreadMemory& memory, std::int64_t entries, int ranks, int jobs, Plan& plan) {
  const std::int64_t K_bytes = entries * (scalar + static_cast<std::int64_t>(sizeof(std::int64_t)));
  const std::int64_t blocks =
      plan.block_columns * (2 * plan.free_dofs / ranks + solution_copies * plan.stored_dofs) * scalar;
  const std::int64_t touches = touched_columns * touched_copies * plan.free_dofs * scalar;
  plan.factor_bytes = memory.expected;
  plan.workspace_bytes = K_bytes + std::max(blocks, touches);
  const double all = plan.flops;
  plan.flops = paths * 2.0 * static_cast<double>(plan.factor_entries) * static_cast<double>(plan.stored_dofs);
  plan.seconds *= plan.flops / std::max(all, 1.0) / solve_efficiency;  // of a single process
  plan.factor_seconds /= together_efficiency * ranks * jobs;
  plan.precision_seconds /= solve_efficiency * ranks;
}

std::string text_of(const SpreadMemory& memory, bool used) {
  const std::int64_t most = used ? memory.used : memory.expected,
                     all = used ? memory.used_all : memory.expected_all;
  return fmt::format("{:.2f} GB of memory in the rank with most, {:.2f} GB in all",
                     static_cast<double>(most) * 1e-9, static_cast<double>(all) * 1e-9);
}

bool needs_more_memory(const Plan& plan, int ranks_here) {
  const std::int64_t available = allotted_memory() / ranks_here;
  return available > 0 && expected_memory(plan) - resident_memory() > available;
}

bool work_while_others_serve(SpreadNumbers& numbers, const BakeRun& run,
                             const std::function<bool(const BakeRun& leader)>& work) {
  bool whole = false;
  if (run.team.leads()) {
    Team alone;
    constexpr int one_thread = 1;  // only one solves with all processes
    whole = work({run.description, run.options, alone, one_thread, run.progress, run.interrupt,
                  [&] { return run.interrupted() || numbers.interrupted(); }, run.summary});
    numbers.release();
  } else {
    numbers.serve(run.interrupted);
  }
  return !run.team.share(whole ? "whole" : "").empty();
}

void spread_columns(SpreadNumbers& numbers, std::span<const std::int64_t> dofs, std::int64_t first,
                    std::int64_t count, std::vector<double>& packed) {
  const auto width = static_cast<std::size_t>(count);
  const auto rows = dofs.subspan(static_cast<std::size_t>(first));
  std::vector<double> loads(width * width, 0.0), solution(rows.size() * width);
  for (std::size_t c = 0; c < width; ++c) loads[c * width + c] = 1.0;
  numbers.multiply(rows.first(width), count, loads, rows, solution);
  packed.clear();
  for (std::size_t c = 0; c < width; ++c)
    for (std::size_t row = c; row < rows.size(); ++row) packed.push_back(solution[row * width + c]);
}

}  // namespace palpate
