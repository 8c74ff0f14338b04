#include "precompute/bake.h"

#include <cblas.h>
#include <fmt/format.h>

#include <atomic>
#include <exception>
#include <mutex>
#include <random>
#include <thread>

#include "formats/model_file.h"
#include "meshes/error.h"
#include "meshes/quality.h"
#include "precompute/body.h"
#include "precompute/factor.h"
#include "precompute/greens.h"
#include "precompute/interrupt.h"
#include "precompute/plan.h"
#include "precompute/progress.h"
#include "precompute/scope.h"

namespace palpate {
namespace {

constexpr int probe_count = 4;

void print_plan(const Plan& plan, const Description& description, const BakeOptions& options,
                Progress& progress) {
  progress.line(fmt::format("{} nodes, {} elements, {} free dofs, {} stored dofs", plan.nodes, plan.elements,
                            plan.free_dofs, plan.stored_dofs));
  progress.line(fmt::format("factor: {:.1f} million entries; Green's functions: {:.1f} MB, {} precision",
                            static_cast<double>(plan.factor_entries) * 1e-6,
                            static_cast<double>(plan.file_bytes) * 1e-6,
                            description.precision == Precision::single_precision ? "single" : "double"));
  progress.line(fmt::format("memory: {:.2f} GB; column solves: {:.3g} GFlop, about {:.1f} s with {} job{}",
                            static_cast<double>(plan.memory_bytes) * 1e-9, plan.flops * 1e-9, plan.seconds,
                            options.jobs, options.jobs == 1 ? "" : "s"));
}

/// Everything that the file holds but Green's functions and probes. The columns' order comes from the factor.
Model describe_model(const Description& description, const BakeOptions& options, MeshedBody body,
                     const Stiffness& stiffness, const GreensSolver& solver) {
  Model model;
  model.name = description.name;
  model.generator = "palpate-precompute " PALPATE_VERSION;
  model.model_toml = description.text;
  model.surface_triangles = std::move(body.surface.triangles);
  model.material = description.material;
  model.fixed = std::move(body.fixed);
  model.scope = description.scope;
  model.layers = description.scope == Scope::layers ? description.layers : 0;
  model.quality = measure_quality(body.mesh);
  model.mesh = std::move(body.mesh);
  model.sources.push_back(describe_source("model", description.file, options.output));
  for (const auto& file : input_files(description)) {
    model.sources.push_back(describe_source("geometry", file, options.output));
  }
  const std::vector<std::int64_t> dofs = solver.stored_dofs();
  for (std::size_t k = 0; k < dofs.size(); k += 3) {
    if (dofs[k] % 3 != 0 || dofs[k + 1] != dofs[k] + 1 || dofs[k + 2] != dofs[k] + 2) {
      throw std::logic_error("the elimination order has separated the dofs of a node");
    }
    model.stored_nodes.push_back(stiffness.free_nodes[static_cast<std::size_t>(dofs[k] / 3)]);
  }
  return model;
}

/// Random forces on all stored dofs, in [-1, 1) N, and their displacements by a plain solve: a second route
/// past the columns.
std::vector<Probe> make_probes(const Factor& factor, const std::vector<std::int64_t>& stored_dofs) {
  std::mt19937_64 random(20240229);
  std::vector<Probe> probes(probe_count);
  for (Probe& probe : probes) {
    std::vector<double> f(static_cast<std::size_t>(factor.order()), 0.0);
    for (const std::int64_t dof : stored_dofs) {
      const double force = static_cast<double>(random() >> 11) * 0x1p-52 - 1.0;
      f[static_cast<std::size_t>(dof)] = force;
      probe.force.push_back(force);
    }
    const std::vector<double> u = factor.solve(f);
    for (const std::int64_t dof : stored_dofs) probe.displacement.push_back(u[static_cast<std::size_t>(dof)]);
  }
  return probes;
}

/// Computes all blocks of columns that the file does not have yet, `jobs` at a time. False when interrupted.
bool solve_columns(const GreensSolver& solver, const Plan& plan, int jobs, ModelWriter& writer,
                   Progress& progress, const InterruptGuard& interrupt) {
  const std::int64_t blocks = (plan.stored_dofs + plan.block_columns - 1) / plan.block_columns;
  std::atomic<std::int64_t> next{0};
  std::atomic<bool> failed{false};
  std::exception_ptr failure;
  double done_flops = 0.0;
  std::int64_t reused = 0;
  std::mutex mutex;  // progress, counters and failure

  const auto work = [&] {
    GreensSolver::Workspace workspace;
    std::vector<double> packed;
    try {
      for (std::int64_t block = next++; block < blocks && !failed && !interrupt.requested(); block = next++) {
        const std::int64_t first = block * plan.block_columns;
        const std::int64_t count = std::min(plan.block_columns, plan.stored_dofs - first);
        const bool have = writer.has_columns(first, count);
        if (!have) {
          solver.columns(first, count, workspace, packed);
          writer.write_columns(first, count, packed);
        }
        const double flops = solver.flops(first, count);
        const std::scoped_lock lock(mutex);
        reused += have ? count : 0;
        done_flops += flops;
        progress.step("Green's functions", done_flops / plan.flops);
      }
    } catch (...) {
      const std::scoped_lock lock(mutex);
      if (!failed.exchange(true)) failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> threads;
    for (int job = 1; job < jobs; ++job) threads.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
  if (interrupt.requested()) return false;
  if (reused > 0)
    progress.line(
        fmt::format("{} of {} columns were kept from an earlier, unfinished run", reused, plan.stored_dofs));
  return true;
}

}  // namespace

BakeResult bake(const Description& description, const BakeOptions& options) {
  Progress progress;
  MeshedBody body = mesh_body(description, [&](const std::string& text) { progress.line(text); });
  for (const std::string& note : body.notes) progress.line("note: " + note);

  const Stiffness stiffness = assemble_stiffness(body.mesh, description.material, body.fixed);
  openblas_set_num_threads(
      1);  // the blocks of columns are the parallel work, and the bytes do not depend on the jobs
  Factor factor(stiffness.K);
  const GreensSolver solver(factor,
                            stored_dof_marks(body.mesh, stiffness, description.scope, description.layers));
  const Plan plan = make_plan(body.mesh, factor, solver, description.precision, options.jobs);
  print_plan(plan, description, options, progress);
  check_memory(plan);
  if (options.dry_run) return BakeResult::planned;

  factor.factorize();
  progress.line("K factorised");
  const Model model = describe_model(description, options, std::move(body), stiffness, solver);
  const InterruptGuard interrupt;
  ModelWriter writer(options.output, model, description.precision);
  if (!solve_columns(solver, plan, options.jobs, writer, progress, interrupt)) {
    writer.discard();
    progress.line("interrupted: nothing was written");
    return BakeResult::interrupted;
  }
  writer.finish(make_probes(factor, solver.stored_dofs()));
  progress.line(fmt::format("{} written", options.output.string()));
  return BakeResult::done;
}

}  // namespace palpate
