#include "precompute/bake_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "precompute/columns.h"
#include "precompute/numerics/inertia.h"
#include "precompute/progress.h"
#include "precompute/spread_plan.h"

namespace palpate {
namespace {

constexpr std::int64_t large_file = 4'000'000'000;  // [byte] too large for many computers to load

void print_plan(const BakeRun& run, const Plan& plan, const Model& model, bool compressed) {
  const QualityReport& quality = model.quality;
  run.progress.line(fmt::format("{} nodes, {} elements ({}), {} free dofs, {} stored dofs", plan.nodes,
                                plan.elements, traits(model.mesh.element).name, plan.free_dofs,
                                plan.stored_dofs));
  run.progress.line(
      fmt::format("angles {:.1f} to {:.1f} degrees, worst shape {:.3f} at ({:.4g}, {:.4g}, {:.4g}) m",
                  quality.min_angle, quality.max_angle, quality.min_shape, quality.worst_centroid.x(),
                  quality.worst_centroid.y(), quality.worst_centroid.z()));
  if (compressed) {
    run.progress.line(fmt::format(
        "factor: {:.1f} million entries; Green's functions: about {:.1f} MB compressed, {:.1f} "
        "MB if they were not; tolerance {:g}",
        static_cast<double>(plan.factor_entries) * 1e-6, static_cast<double>(plan.file_bytes) * 1e-6,
        2e-6 * static_cast<double>(plan.stored_dofs) * static_cast<double>(plan.stored_dofs),
        run.description.tolerance));
    return;
  }
  const std::string precision =
      run.description.precision
          ? fmt::format("{} precision", name_of(*run.description.precision))
          : fmt::format("in single or split precision, or {:.1f} MB in double: decided once K is factorised",
                        static_cast<double>(plan.file_bytes) * 2e-6);
  run.progress.line(fmt::format("factor: {:.1f} million entries; Green's functions: {:.1f} MB, {}",
                                static_cast<double>(plan.factor_entries) * 1e-6,
                                static_cast<double>(plan.file_bytes) * 1e-6, precision));
}

/// Prints the required memory, once all parts of the plan are known.
void print_memory(const BakeRun& run, const Plan& plan, bool compressed) {
  const std::string solves =
      compressed ? "" : fmt::format("column solves: {:.3g} GFlop, ", plan.flops * 1e-9);
  run.progress.line(fmt::format("memory: {:.2f} GB; {}about {} with {} job{}",
                                static_cast<double>(expected_memory(plan)) * 1e-9, solves,
                                duration_text(plan.seconds), run.jobs, run.jobs == 1 ? "" : "s"));
}

/// Text on the total requirements of all ranks.
std::string ranks_text(const BakePlan& bake, const std::vector<Tile>& tiles, int jobs, int ranks) {
  const Plan& plan = bake.plan;
  double seconds = 0.0;
  for (const Stage& stage : stages_of(bake, jobs, ranks)) seconds += stage.seconds;
  const auto memory = static_cast<double>(expected_memory(plan)) * 1e-9;
  const auto threads = std::int64_t{jobs} * ranks;
  std::string text = fmt::format(
      "{} ranks of {} job{}: {:.2f} GB of memory each, {:.1f} GB in all; about {} from the factor to the "
      "file, "
      "{:.1f} hours of a processor",
      ranks, jobs, jobs == 1 ? "" : "s", memory, memory * ranks, duration_text(seconds),
      seconds * static_cast<double>(threads) / 3600.0);
  if (!bake.compression && std::ssize(tiles) < 2 * threads)
    text += fmt::format("; {} blocks of columns for {} threads: fewer ranks would do", tiles.size(), threads);
  return text;
}

/// Advice for reducing the size of a large file.
std::string size_advice(const Description& description) {
  const MeshOptions& mesh = description.mesh;
  const bool keeps_boundary = std::holds_alternative<SurfaceGeometry>(description.geometry) &&
                              mesh.mesher == Mesher::tetgen && !mesh.remesh;
  std::string advice = keeps_boundary     ? "set remesh = true with a larger edge_length in [mesh]"
                       : mesh.edge_length ? "use a larger edge_length in [mesh]"
                                          : "use a coarser mesh";
  if (description.scope != Scope::surface) advice += ", or scope = \"surface\" in [storage]";
  return advice;
}

OverlayPlan announce_overlays(const BakeRun& run, const Model& model) {
  OverlayPlan overlays = plan_overlays(model, *run.description.overlay, run.description.file.string());
  run.progress.line(fmt::format("overlays: {} patches, {} ring{} of elements each, cut into {}^{}: {:.1f} MB",
                                overlays.centres.size(), run.description.overlay->rings,
                                run.description.overlay->rings == 1 ? "" : "s",
                                run.description.overlay->refinement, model.dimension(),
                                static_cast<double>(overlays.file_bytes) * 1e-6));
  return overlays;
}

DynamicsPlan announce_dynamics(const BakeRun& run, const Plan& plan, const Stiffness& stiffness) {
  DynamicsPlan dynamics =
      plan_dynamics(*run.description.dynamics, run.description.scope, plan.stored_dofs, stiffness.K,
                    run.description.precision.value_or(Precision::single_precision));
  const std::string method =
      dynamics.method == DynamicsMethod::packed ? "packed" : fmt::format("modal, {} modes", dynamics.modes);
  run.progress.line(fmt::format("dynamics: {}, {:.1f} MB, {:.2f} GB of memory ({})", method,
                                static_cast<double>(dynamics.file_bytes) * 1e-6,
                                static_cast<double>(dynamics.memory_bytes) * 1e-9, dynamics.reason));
  return dynamics;
}

/// Replaces the requirements of all columns by those of the compression.
void take_over(const CompressionPlan& compression, Plan& plan) {
  const std::int64_t near_bytes = compression.frame.bytes();
  plan.file_bytes = near_bytes + compression.far_bytes;
  plan.workspace_bytes = compression.memory_bytes;
  plan.seconds = 0.0;
  for (const Stage& stage : compression_stages(compression)) plan.seconds += stage.seconds;
}

/// Prints the requirements of the Green's functions.
void announce_greens(const BakeRun& run, const BakePlan& bake, const Model& model) {
  const Plan& plan = bake.plan;
  print_plan(run, plan, model, bake.compression.has_value());
  if (plan.file_bytes <= large_file) return;
  run.progress.line(fmt::format("note: Green's functions of {:.1f} GB take as much memory to feel with{}: {}",
                                static_cast<double>(plan.file_bytes) * 1e-9,
                                bake.compression ? "" : ", and grow with the square of the stored dofs",
                                bake.compression ? size_advice(run.description)
                                                 : "leave out precision and compression in [storage], or " +
                                                       size_advice(run.description)));
}

/// Prints by how much linear tetrahedra are too stiff where they lock: touches of the demo's liver, tet4
/// against tet10 of the same mesh.
void announce_locking(const BakeRun& run, const Model& model) {
  double nu = 0.0;
  for (const Material& material : model.materials) nu = std::max(nu, material.poissons_ratio);
  if (model.mesh.element != ElementType::tet4 || nu <= 0.4) return;
  run.progress.line(fmt::format(
      "note: tet4 at Poisson's ratio {} is too stiff to a touch, by up to 38 % at 0.45 and 87 % at "
      "0.49: element = \"tet4a\" in [mesh] is truer (docs/elements.md)",
      nu));
}

/// Plans all stages and prints their requirements.
BakePlan announce(const BakeRun& run, const Model& model, const AssembledBody& body) {
  const Description& description = run.description;
  BakePlan bake{make_plan(model.mesh, *body.factor, body.solver, description.precision, run.jobs)};
  Plan& plan = bake.plan;
  if (wants_compression(description, plan.stored_dofs / model.dimension())) {
    bake.packed = plan;
    bake.compression = plan_compression(description, model, body.numbering(), *body.factor, plan, run.jobs);
    take_over(*bake.compression, plan);
  }
  announce_greens(run, bake, model);
  if (description.overlay) {
    bake.overlays = announce_overlays(run, model);
    plan.overlay_bytes = bake.overlays.memory_bytes;
  }
  if (description.dynamics) {
    bake.dynamics = announce_dynamics(run, plan, body.stiffness);
    plan.dynamics_bytes = bake.dynamics.memory_bytes;
    if (bake.dynamics.method == DynamicsMethod::modal) plan.dynamics_bytes += inertia_bytes(*body.factor);
    if (bake.dynamics.method == DynamicsMethod::packed)  // factor of K_bar beside that of K
      plan.dynamics_bytes += plan.factor_entries * static_cast<std::int64_t>(sizeof(double));
  }
  print_memory(run, plan, bake.compression.has_value());
  return bake;
}

void check_touchable(const Surface& surface, const Model& model, const Description& description) {
  if (std::none_of(surface.nodes.begin(), surface.nodes.end(),
                   [&](Index node) { return model.fixed[static_cast<std::size_t>(node)] == 0; })) {
    throw Error("no node of the boundary is free along every axis, so nothing can be touched",
                description.file.string(), "Hold a smaller part of the body in [[fixed]]");
  }
}

/// Distributes the factor over all processes if requested, or if one of them cannot hold it.
void spread_where_needed(const BakeRun& run, int ranks, AssembledBody& body, Plan& plan) {
  const Spreading spreading = run.options.spreading;
  Team& team = run.team;
  if (spreading == Spreading::never) return;
  if (spreading == Spreading::where_needed &&
      (!team.can_spread() || !team.any(needs_more_memory(plan, team.size_here()))))
    return;
  SpreadMemory memory = expected_spread_memory(*body.factor, ranks);
  if (ranks == team.size() || !run.options.dry_run) {
    body.factor->spread(team.spread(body.stiffness.K, *body.factor, run.jobs));
    memory = body.factor->spread_numbers()->memory();
  }
  run.summary.spread = memory;
  spread_plan(memory, body.stiffness.K.nonZeros(), ranks, run.jobs, plan);
  run.progress.line(fmt::format("factor over {} rank{} by MUMPS: about {}", ranks, ranks == 1 ? "" : "s",
                                text_of(memory, false)));
}

std::optional<BakePart> planned_part(const BakeOptions& options, const BakePlan& bake,
                                     const GreensSolver& solver) {
  if (!options.part) return {};
  const auto [number, parts] = *options.part;
  const PieceRange pieces =
      share_of(bake.compression ? near_tiles(bake.compression->frame) : column_tiles(solver, bake.plan),
               number, parts);
  const bool two = bake.dynamics.method == DynamicsMethod::packed;
  return BakePart{number, parts, std::vector<PieceRange>(two ? 2 : 1, pieces)};
}

/// Keeps the plan for the report.
void note(const BakePlan& bake, BakeSummary& summary) {
  summary.plan = bake.plan;
  summary.foretold = std::max(summary.foretold, expected_memory(bake.plan));
  summary.compressed = bake.compression.has_value();
}

}  // namespace

std::vector<Stage> stages_of(const BakePlan& bake, int jobs, int ranks) {
  const auto& [plan, packed_plan, compression, overlays, dynamics, part] = bake;
  std::vector<Stage> stages = {{factor_stage, plan.factor_seconds}};
  if (!overlays.centres.empty())
    stages.push_back({overlay_stage, overlay_seconds(overlays.file_bytes, jobs) / ranks});
  if (dynamics.method == DynamicsMethod::modal)
    stages.push_back({modes_stage, modes_seconds(plan, dynamics.modes)});
  if (compression) {
    const std::vector<Stage> more = compression_stages(*compression, ranks);
    stages.insert(stages.end(), more.begin(), more.end());
    stages.push_back({write_stage, plan.write_seconds});
    return stages;
  }
  const bool packed = dynamics.method == DynamicsMethod::packed;
  stages.push_back({precision_stage, plan.precision_seconds * (packed ? 2.0 : 1.0) +
                                         plan.factor_seconds * (packed ? 1.0 : 0.0)});
  stages.push_back({column_stage(PackedMatrix::greens), plan.seconds / ranks});
  if (packed) {
    stages.push_back({inverse_factor_stage, plan.factor_seconds});
    stages.push_back({column_stage(PackedMatrix::inverse), plan.seconds / ranks});
  }
  stages.push_back({write_stage, plan.write_seconds});
  return stages;
}

BakePlan plan_bake(const BakeRun& run, const MeshedModel& meshed, AssembledBody& body) {
  check_touchable(meshed.surface, meshed.model, run.description);
  BakePlan bake = announce(run, meshed.model, body);
  announce_locking(run, meshed.model);
  const int ranks = run.options.ranks > 0 ? run.options.ranks : run.team.size();
  spread_where_needed(run, ranks, body, bake.plan);
  if (ranks > 1) run.progress.line(ranks_text(bake, column_tiles(body.solver, bake.plan), run.jobs, ranks));
  if (!meshed.warning.empty()) run.progress.warn(meshed.warning);
  check_memory(bake.plan, run.team.size_here());
  bake.part = planned_part(run.options, bake, body.solver);
  note(bake, run.summary);
  return bake;
}

void fall_back(const BakeRun& run, const std::string& why, const AssembledBody& body, Model& model,
               BakePlan& bake) {
  run.summary.fell_back = why;
  run.progress.line(
      "note: compression = \"auto\" stores every entry of these Green's functions: " + why +
      (run.options.parts.empty() ? "" : "; the parts have compressed ones and are of no use here"));
  bake.compression.reset();
  model.compressed.reset();
  const Plan compressed = std::exchange(bake.plan, bake.packed);
  bake.plan.overlay_bytes = compressed.overlay_bytes;
  bake.plan.dynamics_bytes = compressed.dynamics_bytes;
  if (run.summary.spread)
    spread_plan(*run.summary.spread, body.stiffness.K.nonZeros(), run.team.size(), run.jobs, bake.plan);
  announce_greens(run, bake, model);
  print_memory(run, bake.plan, false);
  check_memory(bake.plan, run.team.size_here());
  note(bake, run.summary);
  std::vector<Stage> stages = stages_of(bake, run.jobs, run.team.size());
  stages.erase(stages.begin());  // there is a factor
  run.progress.plan(std::move(stages));
}

}  // namespace palpate
