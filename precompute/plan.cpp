#include "precompute/plan.h"

#include <cblas.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <fstream>
#include <string>
#include <vector>

#include "base/error.h"
#include "precompute/machine/allotment.h"

namespace palpate {
namespace {

constexpr std::int64_t max_block_columns = 192;
// If there is work for many threads, blocks are narrower, so that 2 048 threads find enough of them, and of
// several widths, so that the threads of a node do not all write at once; narrow blocks at the end let all
// threads finish together. With 300 000 columns 2 048 threads are then busy 93 % of the time; with 96 columns
// everywhere 74 %, with 192 45 % (scripts/studies/cluster).
constexpr std::array<std::int64_t, 4> widths_for_many = {84, 72, 60, 48};
constexpr std::int64_t last_width_for_many = 24;
constexpr double last_part_for_many = 0.2;  // of all columns
constexpr double work_for_many = 1e12;      // multiplications and additions of all columns
constexpr std::int64_t max_block_bytes = 512LL << 20;
constexpr double sweep_efficiency =
    0.4;  // sweeps relative to plain products: gathers and small supernodes (measured)
constexpr double factor_efficiency = 0.5;     // CHOLMOD's factorisation relative to them (measured)
constexpr double checksum_rate = 1e9;         // while the file is read back [byte/s]
constexpr double solve_rate = 3.5e9;          // for one right-hand side [flop/s] (measured)
constexpr double solves_for_precision = 900;  // for eight places of 30 nodes, and the smooth part
constexpr double solves_at_the_end = 4;       // for the probes
constexpr double solves_per_mode = 5;  // of Lanczos' method, its products of vectors among them (measured)
constexpr double overlay_seconds_per_byte = 1e-8;    // for patches of two rings (measured)
constexpr std::int64_t bytes_of_thread = 1'600'000;  // (measured)

/// Multiply-adds per second of one thread in products of the sweeps' shape.
double measured_flops_per_second() {
  constexpr int m = 192, n = 128, k = 24;
  const std::vector<double> A(std::size_t{m} * k, 1.0), B(std::size_t{k} * n, 1.0);
  std::vector<double> C(std::size_t{m} * n, 0.0);
  const auto start = std::chrono::steady_clock::now();
  double spent = 0.0, flops = 0.0;
  while (spent < 0.05) {
    cblas_dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, m, n, k, 1.0, A.data(), m, B.data(), k, 0.0,
                C.data(), m);
    flops += 2.0 * m * n * k;
    spent = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  return flops / spent;
}

/// Columns per block: as wide as pays off while the block's right-hand sides stay below max_block_bytes.
/// Depends on the model alone: products of other widths may differ in their last digits.
std::int64_t widest_block(std::int64_t free_dofs) {
  const std::int64_t fits = max_block_bytes / (free_dofs * static_cast<std::int64_t>(sizeof(double)));
  return std::clamp<std::int64_t>(fits / 24 * 24, 24, max_block_columns);
}

/// Columns of block k if blocks are for many threads; `first` is its first column of `all`.
std::int64_t width_for_many(std::size_t k, std::int64_t first, std::int64_t all) {
  const bool last = static_cast<double>(all - first) <= last_part_for_many * static_cast<double>(all);
  return last ? last_width_for_many : widths_for_many[k % widths_for_many.size()];
}

double column_flops(const GreensSolver& solver, const Plan& plan) {
  double flops = 0.0;
  for (const PieceRange& block : column_blocks(plan))
    flops += solver.flops(block.first, block.end - block.first);
  return flops;
}

/// Number of the `jobs` threads that have a processor.
int working(int jobs) {
  return std::min(jobs, allotted_processors());
}

}  // namespace

std::vector<PieceRange> column_blocks(const Plan& plan) {
  std::vector<PieceRange> blocks;
  const std::int64_t all = plan.stored_dofs;
  for (std::int64_t first = 0; first < all;) {
    const std::int64_t width = plan.for_many ? width_for_many(blocks.size(), first, all) : plan.block_columns;
    const std::int64_t end = std::min(first + std::min(width, plan.block_columns), all);
    blocks.push_back({first, end});
    first = end;
  }
  return blocks;
}

Plan make_plan(const Mesh& mesh, const Factor& factor, const GreensSolver& solver,
               std::optional<Precision> precision, int jobs) {
  Plan plan;
  plan.nodes = static_cast<std::int64_t>(mesh.nodes.size());
  plan.elements = mesh.elements();
  plan.free_dofs = factor.order();
  plan.stored_dofs = solver.order();
  plan.factor_entries = factor.entries();
  plan.file_bytes =
      packed_size(plan.stored_dofs) * bytes_per_scalar(precision.value_or(Precision::single_precision));
  plan.block_columns = widest_block(plan.free_dofs);
  plan.flops = column_flops(solver, plan);
  plan.for_many = plan.flops >= work_for_many;
  if (plan.for_many) {
    plan.block_columns = std::min(plan.block_columns, widths_for_many.front());
    plan.flops = column_flops(solver, plan);
  }
  plan.factor_bytes = plan.factor_entries * static_cast<std::int64_t>(sizeof(double));
  plan.resident_bytes = resident_memory();
  const auto threads = std::min<std::int64_t>(jobs, std::ssize(column_blocks(plan)));
  plan.workspace_bytes = threads * solver.workspace_bytes(plan.block_columns) + thread_bytes(threads);
  const double rate = measured_flops_per_second();
  plan.seconds = plan.flops / (sweep_efficiency * rate * working(jobs));
  plan.factor_seconds = factor.flops() / (factor_efficiency * rate);
  plan.precision_seconds = solves_for_precision * 4.0 * static_cast<double>(plan.factor_entries) / solve_rate;
  plan.write_seconds = static_cast<double>(plan.file_bytes) / checksum_rate +
                       solves_at_the_end * 4.0 * static_cast<double>(plan.factor_entries) / solve_rate;
  return plan;
}

double overlay_seconds(std::int64_t bytes, int jobs) {
  return overlay_seconds_per_byte * static_cast<double>(bytes) / working(jobs);
}

double modes_seconds(const Plan& plan, std::int64_t modes) {
  return solves_per_mode * static_cast<double>(modes) * 4.0 * static_cast<double>(plan.factor_entries) /
         solve_rate;
}

std::int64_t expected_memory(const Plan& plan) {
  return plan.resident_bytes + plan.factor_bytes +
         std::max(plan.workspace_bytes, plan.overlay_bytes + plan.dynamics_bytes);
}

std::int64_t thread_bytes(std::int64_t threads) {
  return threads * bytes_of_thread;
}

std::int64_t resident_memory() {
  std::ifstream statm("/proc/self/statm");
  std::int64_t all = 0, resident = 0;
  statm >> all >> resident;
  return resident * ::sysconf(_SC_PAGESIZE);
}

void check_memory(const Plan& plan, int ranks) {
  const std::int64_t available = allotted_memory() / ranks;
  const std::int64_t needed = expected_memory(plan) - resident_memory();
  if (available == 0 || needed <= available) return;  // 0: the kernel does not say
  const std::string overlays =
      plan.overlay_bytes == 0
          ? ""
          : fmt::format(", {:.2f} GB for overlays", static_cast<double>(plan.overlay_bytes) / 1e9);
  const std::string dynamics =
      plan.dynamics_bytes == 0
          ? ""
          : fmt::format(", {:.2f} GB for dynamics", static_cast<double>(plan.dynamics_bytes) / 1e9);
  throw Error(
      fmt::format("{:.2f} GB of memory are needed, {:.2f} GB are free: {:.2f} GB for the factor ({} entries)"
                  "{}{} and the rest for blocks of {} columns",
                  static_cast<double>(needed) / 1e9, static_cast<double>(available) / 1e9,
                  static_cast<double>(plan.factor_bytes) * 1e-9, plan.factor_entries, overlays, dynamics,
                  plan.block_columns),
      "memory",
      std::string("Use fewer --jobs, a larger mesh.edge_length or a stronger mesh.grading") +
          ", or more nodes that share the factor (palpate-precompute-mpi)" +
          (ranks > 1 ? ", or fewer ranks of this machine" : "") +
          (overlays.empty() ? "" : ", or smaller regions in [overlay]") +
          (dynamics.empty() ? "" : ", or fewer modes in [dynamics]"));
}

}  // namespace palpate
