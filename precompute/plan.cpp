#include "precompute/plan.h"

#include <cblas.h>
#include <fmt/format.h>

#include <chrono>
#include <string>
#include <vector>

#include "base/error.h"
#include "precompute/allotment.h"

namespace palpate {
namespace {

constexpr std::int64_t max_block_columns = 192;
// Where there is work for many threads, blocks are narrower, so that 2 048 threads find enough of them: of
// 300 000 columns they then are busy for 90 % of the time in place of 45 %. It costs 3 % (48 columns 13 %).
constexpr std::int64_t block_columns_for_many = 96;
constexpr double work_for_many = 1e12;  // multiplications and additions of all columns
constexpr std::int64_t max_block_bytes = 512LL << 20;
constexpr double sweep_efficiency =
    0.4;  // of the sweeps against products alone: gathers and small supernodes (measured)
constexpr double factor_efficiency = 0.5;     // of CHOLMOD's factorisation against them (measured)
constexpr double checksum_rate = 1e9;         // while the file is read back [byte/s]
constexpr double solve_rate = 3.5e9;          // of one right-hand side [flop/s] (measured)
constexpr double solves_for_precision = 900;  // of eight places of 30 nodes, and of the smooth part
constexpr double solves_at_the_end = 4;       // of the probes
constexpr double solves_per_mode = 6;  // of Lanczos' method, its products of vectors among them (measured)
constexpr double overlay_seconds_per_byte = 1e-8;  // of patches of two rings (measured)

/// Multiply-adds a second of one thread in products shaped as the sweeps are.
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

/// Columns a block: as wide as pays, but one block's right-hand sides stay below max_block_bytes. It depends
/// on the model alone: products of other widths may differ in their last digits.
std::int64_t choose_block_columns(std::int64_t free_dofs, double flops) {
  const std::int64_t fits = max_block_bytes / (free_dofs * static_cast<std::int64_t>(sizeof(double)));
  return std::clamp<std::int64_t>(fits / 24 * 24, 24,
                                  flops < work_for_many ? max_block_columns : block_columns_for_many);
}

/// Flops of all columns, in blocks of so many.
double column_flops(const GreensSolver& solver, std::int64_t block) {
  double flops = 0.0;
  for (std::int64_t first = 0; first < solver.order(); first += block)
    flops += solver.flops(first, std::min(block, solver.order() - first));
  return flops;
}

/// How many of `jobs` threads have a processor.
int working(int jobs) {
  return std::min(jobs, allotted_processors());
}

}  // namespace

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
  plan.block_columns = choose_block_columns(plan.free_dofs, column_flops(solver, max_block_columns));
  plan.flops = column_flops(solver, plan.block_columns);
  plan.factor_bytes = plan.factor_entries * static_cast<std::int64_t>(sizeof(double));
  plan.memory_bytes = plan.factor_bytes + jobs * solver.workspace_bytes(plan.block_columns);
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
  const double solves = solves_per_mode * static_cast<double>(modes);
  return solves * 4.0 * static_cast<double>(plan.factor_entries) / solve_rate;
}

void check_memory(const Plan& plan, int ranks) {
  const std::int64_t available = allotted_memory() / ranks;
  const std::int64_t needed = plan.memory_bytes + plan.overlay_bytes + plan.dynamics_bytes;
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
          (overlays.empty() ? "" : ", or smaller regions in [overlay]") +
          (dynamics.empty() ? "" : ", or fewer modes in [dynamics]"));
}

}  // namespace palpate
