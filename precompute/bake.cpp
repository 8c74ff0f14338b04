#include "precompute/bake.h"

#include <cblas.h>
#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <utility>

#include "base/error.h"
#include "base/interrupt.h"
#include "base/limits/child_seal.h"
#include "base/parallel.h"
#include "formats/begun_model.h"
#include "formats/journal.h"
#include "formats/model_check.h"
#include "formats/model_file.h"
#include "formats/outputs/output_paths.h"
#include "formats/outputs/part_files.h"
#include "formats/writer/model_writer.h"
#include "meshes/quality.h"
#include "precompute/columns.h"
#include "precompute/compressed_greens.h"
#include "precompute/compression/out_of_reach.h"
#include "precompute/machine/blas_kernels.h"
#include "precompute/machine/blas_room.h"
#include "precompute/numerics/dynamics.h"
#include "precompute/numerics/factor.h"
#include "precompute/numerics/greens_solver.h"
#include "precompute/numerics/inertia.h"
#include "precompute/numerics/loads.h"
#include "precompute/numerics/meshed_body.h"
#include "precompute/numerics/overlay_regions.h"
#include "precompute/numerics/precision.h"
#include "precompute/numerics/scope.h"
#include "precompute/plan.h"
#include "precompute/progress.h"
#include "precompute/spread_plan.h"
#include "precompute/team_sharing.h"
#include "precompute/warping/warp_study.h"

namespace palpate {
namespace {

constexpr int probe_count = 4;
constexpr std::int64_t large_file = 4'000'000'000;  // [byte] too large for many computers to load

void print_plan(const Plan& plan, const Model& model, const Description& description, bool compressed,
                Progress& progress) {
  const QualityReport& quality = model.quality;
  progress.line(fmt::format("{} nodes, {} elements ({}), {} free dofs, {} stored dofs", plan.nodes,
                            plan.elements, traits(model.mesh.element).name, plan.free_dofs,
                            plan.stored_dofs));
  progress.line(
      fmt::format("angles {:.1f} to {:.1f} degrees, worst shape {:.3f} at ({:.4g}, {:.4g}, {:.4g}) m",
                  quality.min_angle, quality.max_angle, quality.min_shape, quality.worst_centroid.x(),
                  quality.worst_centroid.y(), quality.worst_centroid.z()));
  if (compressed) {
    progress.line(fmt::format(
        "factor: {:.1f} million entries; Green's functions: about {:.1f} MB compressed, {:.1f} "
        "MB if they were not; tolerance {:g}",
        static_cast<double>(plan.factor_entries) * 1e-6, static_cast<double>(plan.file_bytes) * 1e-6,
        2e-6 * static_cast<double>(plan.stored_dofs) * static_cast<double>(plan.stored_dofs),
        description.tolerance));
    return;
  }
  const std::string precision =
      description.precision
          ? fmt::format("{} precision", name_of(*description.precision))
          : fmt::format("in single or split precision, or {:.1f} MB in double: decided once K is factorised",
                        static_cast<double>(plan.file_bytes) * 2e-6);
  progress.line(fmt::format("factor: {:.1f} million entries; Green's functions: {:.1f} MB, {}",
                            static_cast<double>(plan.factor_entries) * 1e-6,
                            static_cast<double>(plan.file_bytes) * 1e-6, precision));
}

/// Prints the required memory, once all parts of the plan are known.
void print_memory(const Plan& plan, const BakeOptions& options, bool compressed, Progress& progress) {
  const std::string solves =
      compressed ? "" : fmt::format("column solves: {:.3g} GFlop, ", plan.flops * 1e-9);
  progress.line(fmt::format("memory: {:.2f} GB; {}about {} with {} job{}",
                            static_cast<double>(expected_memory(plan)) * 1e-9, solves,
                            duration_text(plan.seconds), options.jobs, options.jobs == 1 ? "" : "s"));
}

constexpr const char* factor_stage = "factorising K";
constexpr const char* overlay_stage = "overlays";
constexpr const char* modes_stage = "looking for modes";
constexpr const char* warp_stage = "bending the body";
constexpr double warp_factors = 75.0;  // per level: about 25 without supernodes, each three times as slow
constexpr const char* precision_stage = "choosing the precision";
constexpr const char* inverse_factor_stage = "factorising K_bar";
constexpr const char* write_stage = "writing the file";

struct Plans {
  Plan plan;
  Plan packed;  // for every entry, if compression is planned
  std::optional<CompressionPlan> compression;
  OverlayPlan overlays;
  DynamicsPlan dynamics;
  Index warp_levels = 0;  // for a study of [warp]
};

/// Arguments common to the stages that solve columns.
struct Shared {
  int jobs;
  Team& team;
  Progress& progress;
  TileCounts& tiles;
  std::function<bool()> interrupted;
};

/// Stages after the plan, for this number of ranks.
std::vector<Stage> stages_of(const Plans& plans, int jobs, int ranks) {
  const auto& [plan, packed_plan, compression, overlays, dynamics, warp_levels] = plans;
  std::vector<Stage> stages = {{factor_stage, plan.factor_seconds}};
  if (!overlays.centres.empty())
    stages.push_back({overlay_stage, overlay_seconds(overlays.file_bytes, jobs) / ranks});
  if (dynamics.method == DynamicsMethod::modal)
    stages.push_back({modes_stage, modes_seconds(plan, dynamics.modes, jobs)});
  if (warp_levels > 0) stages.push_back({warp_stage, warp_factors * warp_levels * plan.factor_seconds});
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

/// Text on the total requirements of all ranks.
std::string ranks_text(const Plans& plans, const std::vector<Tile>& tiles, int jobs, int ranks) {
  const Plan& plan = plans.plan;
  double seconds = 0.0;
  for (const Stage& stage : stages_of(plans, jobs, ranks)) seconds += stage.seconds;
  const auto memory = static_cast<double>(expected_memory(plan)) * 1e-9;
  const auto threads = std::int64_t{jobs} * ranks;
  std::string text = fmt::format(
      "{} ranks of {} job{}: {:.2f} GB of memory each, {:.1f} GB in all; about {} from the factor to the "
      "file, "
      "{:.1f} hours of a processor",
      ranks, jobs, jobs == 1 ? "" : "s", memory, memory * ranks, duration_text(seconds),
      seconds * static_cast<double>(threads) / 3600.0);
  if (!plans.compression && std::ssize(tiles) < 2 * threads)
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

/// Stored nodes in the order of the columns, which the factor determines.
StoredNumbering number_stored(const GreensSolver& solver, const Stiffness& stiffness, int dimension) {
  const std::vector<std::int64_t> columns = solver.stored_dofs();
  const auto d = static_cast<std::size_t>(dimension);
  std::vector<Index> nodes(columns.size() / d, -1);  // mesh nodes
  for (std::size_t k = 0; k < columns.size(); ++k) {
    if (columns[k] < 0) continue;
    const std::int64_t dof = stiffness.free_dofs[static_cast<std::size_t>(columns[k])];
    Index& node = nodes[k / d];
    if (node < 0) node = static_cast<Index>(dof / dimension);
    if (dof != std::int64_t{dimension} * node + static_cast<std::int64_t>(k % d)) {
      throw std::logic_error("the elimination order has separated the dofs of a node");
    }
  }
  return {nodes, columns};
}

/// Everything in the file except Green's functions, probes and the rest state.
Model describe_model(const Description& description, const BakeOptions& options, MeshedBody body) {
  Model model;
  model.name = description.name;
  model.generator = "palpate-precompute " PALPATE_VERSION;
  model.model_toml = description.text;
  model.surface = surface_simplices(body.surface);
  model.analysis = description.analysis;
  model.thickness = description.thickness;
  for (const MaterialPart& part : description.materials) model.materials.push_back(part.material);
  model.material_of_element = std::move(body.material_of_element);
  model.fixed = std::move(body.fixed);
  model.scope = description.scope;
  model.layers = description.scope == Scope::layers ? description.layers : 0;
  model.quality = measure_quality(body.mesh);
  model.mesh = std::move(body.mesh);
  model.rest_displacement.assign(model.mesh.nodes.size(), Vec3::Zero());  // until it is computed
  model.sources.push_back(describe_source("model", description.file, options.output));
  for (const auto& file : input_files(description)) {
    model.sources.push_back(describe_source("geometry", file, options.output));
  }
  return model;
}

/// Random forces on all stored dofs, in [-1, 1) N (those on held dofs have no effect), and their
/// displacements by a plain solve, independent of the columns.
std::vector<Probe> make_probes(const Factor& factor, const std::vector<std::int64_t>& stored_dofs) {
  std::mt19937_64 random(20240229);
  std::vector<Probe> probes(probe_count);
  for (Probe& probe : probes) {
    std::vector<double> f(static_cast<std::size_t>(factor.order()), 0.0);
    for (const std::int64_t dof : stored_dofs) {
      const double force = static_cast<double>(random() >> 11) * 0x1p-52 - 1.0;
      if (dof >= 0) f[static_cast<std::size_t>(dof)] = force;
      probe.force.push_back(force);
    }
    const std::vector<double> u = factor.solve(f);
    for (const std::int64_t dof : stored_dofs) {
      probe.displacement.push_back(dof < 0 ? 0.0 : u[static_cast<std::size_t>(dof)]);
    }
  }
  return probes;
}

SparseMatrix stiffness_of_step(const ElasticBody& body, const Stiffness& stiffness,
                               const DynamicsOptions& options) {
  return effective_stiffness(stiffness.K, assemble_mass(body, stiffness, options.lumped), options.damping,
                             options.newmark);
}

/// Chooses the precision of all packed matrices and sets their smooth parts and force errors in the model.
Precision decide_precision(const Description& description, const ElasticBody& body,
                           const Stiffness& stiffness, const Factor& factor,
                           const std::vector<std::int64_t>& stored_dofs, Team& team, int jobs, Model& model,
                           Progress& progress) {
  std::vector<PrecisionStudy> studies;
  studies.emplace_back(model, factor, stiffness.K, stored_dofs);
  if (model.dynamics.method == DynamicsMethod::packed) {
    const SparseMatrix K_bar = stiffness_of_step(body, stiffness, *description.dynamics);
    Factor factor_bar(K_bar, stiffness.node_start);
    spread_likewise(factor, K_bar, team, jobs, factor_bar);
    factor_bar.factorize();
    studies.emplace_back(model, factor_bar, K_bar, stored_dofs);
  }
  const PrecisionChoice choice = choose_precision(studies, description.precision);
  const auto smooth = [&](const PrecisionStudy& study) {
    return choice.precision == Precision::split_precision ? study.smooth(choice.terms) : nullptr;
  };
  const std::int64_t n = model.stored_dofs();
  model.greens = PackedGreens(nullptr, n, choice.precision, smooth(studies.front()));
  model.force_errors = choice.errors.front();
  if (studies.size() > 1) {
    model.dynamics.inverse = PackedGreens(nullptr, n, choice.precision, smooth(studies.back()));
    model.dynamics.force_errors = choice.errors.back();
  }
  progress.line(fmt::format(
      "precision: {}{}; force errors: {}", name_of(choice.precision),
      model.greens.smooth() == nullptr ? "" : fmt::format(", {} smooth terms", model.greens.smooth()->terms),
      errors_text(choice.errors)));
  if (const std::string warning = precision_warning(model, choice.precision); !warning.empty())
    progress.warn(warning);
  return choice.precision;
}

/// Factorises K_bar and computes the columns of its inverse, numbered as those of Xi. Returns false if
/// interrupted.
bool solve_inverse(const ElasticBody& body, const Stiffness& stiffness, const DynamicsOptions& options,
                   const std::vector<std::uint8_t>& stored, const std::vector<std::int64_t>& stored_dofs,
                   const Plan& plan, const PieceRange& columns, bool spread, const Shared& run,
                   ModelWriter& writer) {
  const SparseMatrix K_bar = stiffness_of_step(body, stiffness, options);
  Factor factor(K_bar, stiffness.node_start);
  const GreensSolver solver(factor, stored, stiffness.free_dofs, body.mesh.dimension());
  if (solver.stored_dofs() != stored_dofs) {
    throw std::logic_error("K_bar and K, of one pattern, have different elimination orders");
  }
  if (writer.has_columns(columns.first, columns.end - columns.first, PackedMatrix::inverse)) return true;
  run.progress.begin(inverse_factor_stage);
  if (spread) factor.spread(run.team.spread(K_bar, factor, run.jobs));
  factor.factorize();
  return solve_columns(solver, plan, columns, run.jobs, run.team, writer, PackedMatrix::inverse, run.progress,
                       run.tiles, run.interrupted);
}

OverlayPlan announce_overlays(const Description& description, const Model& model, Progress& progress) {
  OverlayPlan overlays = plan_overlays(model, *description.overlay, description.file.string());
  progress.line(fmt::format("overlays: {} patches, {} ring{} of elements each, cut into {}^{}: {:.1f} MB",
                            overlays.centres.size(), description.overlay->rings,
                            description.overlay->rings == 1 ? "" : "s", description.overlay->refinement,
                            model.dimension(), static_cast<double>(overlays.file_bytes) * 1e-6));
  return overlays;
}

DynamicsPlan announce_dynamics(const Description& description, const Plan& plan, const Stiffness& stiffness,
                               Progress& progress) {
  DynamicsPlan dynamics =
      plan_dynamics(*description.dynamics, description.scope, plan.stored_dofs, stiffness.K,
                    description.precision.value_or(Precision::single_precision));
  const std::string method =
      dynamics.method == DynamicsMethod::packed ? "packed" : fmt::format("modal, {} modes", dynamics.modes);
  progress.line(fmt::format("dynamics: {}, {:.1f} MB, {:.2f} GB of memory ({})", method,
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
void announce_greens(const Plans& plans, const Model& model, const Description& description,
                     Progress& progress) {
  const Plan& plan = plans.plan;
  print_plan(plan, model, description, plans.compression.has_value(), progress);
  if (plan.file_bytes <= large_file) return;
  progress.line(fmt::format("note: Green's functions of {:.1f} GB take as much memory to feel with{}: {}",
                            static_cast<double>(plan.file_bytes) * 1e-9,
                            plans.compression ? "" : ", and grow with the square of the stored dofs",
                            plans.compression ? size_advice(description)
                                              : "leave out precision and compression in [storage], or " +
                                                    size_advice(description)));
}

/// Plans all stages and prints their requirements.
Plans announce_plans(const Description& description, const BakeOptions& options, const Model& model,
                     const Stiffness& stiffness, const Factor& factor, const GreensSolver& solver,
                     Progress& progress) {
  Plans plans{make_plan(model.mesh, factor, solver, description.precision, options.jobs), {}, {}, {}, {}};
  if (description.warp) plans.warp_levels = description.warp->levels;
  Plan& plan = plans.plan;
  if (wants_compression(description, plan.stored_dofs / model.dimension())) {
    const StoredNumbering stored = number_stored(solver, stiffness, model.dimension());
    plans.packed = plan;
    plans.compression = plan_compression(description, model, stored, factor, plan, options.jobs);
    take_over(*plans.compression, plan);
  }
  announce_greens(plans, model, description, progress);
  if (description.overlay) {
    plans.overlays = announce_overlays(description, model, progress);
    plan.overlay_bytes = plans.overlays.memory_bytes;
  }
  if (description.dynamics) {
    plans.dynamics = announce_dynamics(description, plan, stiffness, progress);
    plan.dynamics_bytes = plans.dynamics.memory_bytes;
    if (plans.dynamics.method == DynamicsMethod::modal) plan.dynamics_bytes += inertia_bytes(factor);
    if (plans.dynamics.method == DynamicsMethod::packed)  // factor of K_bar beside that of K
      plan.dynamics_bytes += plan.factor_entries * static_cast<std::int64_t>(sizeof(double));
  }
  print_memory(plan, options, plans.compression.has_value(), progress);
  return plans;
}

/// Adds dynamics with the threads of each process alone, since a block of vectors keeps only two busy.
/// Returns false, in all processes, if interrupted.
bool add_dynamics(const Description& description, const DynamicsPlan& plan, const ElasticBody& body,
                  const Stiffness& stiffness, const Factor& factor,
                  const std::vector<std::int64_t>& stored_dofs, Team& team, int jobs, Model& model,
                  Progress& progress, const InterruptGuard& interrupt) {
  if (!description.dynamics) return true;
  if (plan.method == DynamicsMethod::modal) progress.begin(modes_stage);
  Team alone;
  const bool in_step = factor.spread_numbers() != nullptr;  // no process may stop before the others
  TeamSharing sharing(alone, jobs, [&] { return !in_step && interrupt.requested(); });
  std::optional<StoredDynamics> dynamics = describe_dynamics(
      *description.dynamics, plan, stiffness.K, assemble_mass(body, stiffness, description.dynamics->lumped),
      factor, stored_dofs, sharing);
  if (team.any(!dynamics)) return false;
  model.dynamics = *std::move(dynamics);
  return true;
}

/// Adds a study of warping if requested. Returns false, in all processes, if interrupted.
bool add_warp(const Description& description, Team& team, Model& model, Progress& progress,
              const InterruptGuard& interrupt) {
  if (!description.warp) return true;
  progress.begin(warp_stage);
  const std::optional<WarpStudyResult> result = study_warp(model, *description.warp, [&](double share) {
    progress.reach(share);
    return !interrupt.requested();
  });
  if (team.any(!result)) return false;
  model.warp = result->study;
  progress.line(range_text(model.warp));
  if (!result->note.empty()) progress.line("note: the study of [warp] " + result->note);
  return true;
}

/// Results computed after the file is begun.
struct Solved {
  std::vector<Probe> probes;
  std::shared_ptr<const HierarchicalMatrix> compressed;
};

/// Computes the columns of the packed matrices, of a part or all, and in the leader the probes of the first
/// matrix. Returns nullopt if interrupted.
std::optional<Solved> solve_matrices(const Description& description, const ElasticBody& body,
                                     const Stiffness& stiffness, std::unique_ptr<Factor> factor,
                                     const GreensSolver& solver, const std::vector<std::uint8_t>& stored,
                                     const Plans& plans, const std::optional<BakePart>& part,
                                     const Shared& run, ModelWriter& writer) {
  const std::vector<std::int64_t> stored_dofs = solver.stored_dofs();
  const PieceRange columns = part ? part->pieces.front() : PieceRange{0, plans.plan.stored_dofs};
  if (!solve_columns(solver, plans.plan, columns, run.jobs, run.team, writer, PackedMatrix::greens,
                     run.progress, run.tiles, run.interrupted))
    return {};
  Solved solved;
  const bool spread = factor->spread_numbers() != nullptr;
  if ((run.team.leads() || spread) && !part) solved.probes = make_probes(*factor, stored_dofs);
  if (plans.dynamics.method == DynamicsMethod::packed) {
    factor.reset();  // frees its memory for the factor of K_bar
    if (!solve_inverse(body, stiffness, *description.dynamics, stored, stored_dofs, plans.plan, columns,
                       spread, run, writer))
      return {};
  }
  return solved;
}

/// Compresses the Green's functions in the leader while the other processes help to solve. Returns nullopt if
/// interrupted.
std::optional<Solved> solve_compressed_alone(const CompressionPlan& plan, const Factor& factor,
                                             SpreadNumbers& spread, const Shared& run, ModelWriter& writer) {
  Solved solved;
  std::string refused;  // reason if it is out of reach
  const auto compress = [&](const std::function<bool()>& interrupted) {
    constexpr int one_thread = 1;  // only one solves with all ranks
    Team alone;
    try {
      GreensCompressor compressor(plan, factor, alone, one_thread, run.progress, interrupted);
      if (compressor.solve_near({0, plan.frame.tree.leaves()}, writer, run.tiles))
        solved.compressed = compressor.compress(writer);
      if (solved.compressed == nullptr) return false;
      solved.probes = make_probes(factor, plan.stored.dofs);
    } catch (const OutOfReach& error) {
      refused = to_text(error);
    }
    return true;
  };
  const bool whole = work_while_others_serve(spread, run.team, run.interrupted, compress);
  refused = run.team.share(refused);
  if (!refused.empty()) throw OutOfReach(refused, "", "");
  return whole ? std::optional(std::move(solved)) : std::nullopt;
}

/// Makes data written by all processes, on any machine, visible to processes that read (`reads`). To the
/// others the file may already be complete and renamed.
void see_all(Team& team, ModelWriter& writer, bool reads) {
  if (team.size() == 1) return;
  writer.flush();
  team.any(false);  // all have flushed
  if (reads) writer.look_again();
}

/// Compresses the Green's functions; a part solves for some of the near pairs. Returns nullopt if
/// interrupted.
std::optional<Solved> solve_compressed(const CompressionPlan& plan, const Factor& factor,
                                       const std::optional<BakePart>& part, const Shared& run,
                                       ModelWriter& writer) {
  if (SpreadNumbers* spread = factor.spread_numbers(); spread != nullptr)
    return solve_compressed_alone(plan, factor, *spread, run, writer);
  GreensCompressor compressor(plan, factor, run.team, run.jobs, run.progress, run.interrupted);
  const PieceRange leaves = part ? part->pieces.front() : PieceRange{0, plan.frame.tree.leaves()};
  if (!compressor.solve_near(leaves, writer, run.tiles)) return {};
  Solved solved;
  if (part) return solved;
  see_all(run.team, writer, true);
  solved.compressed = compressor.compress(writer);
  if (solved.compressed == nullptr) return {};
  if (run.team.leads()) solved.probes = make_probes(factor, plan.stored.dofs);
  return solved;
}

/// Condenses the overlays for the file. Returns false if interrupted.
bool add_overlays(const Description& description, const OverlayPlan& overlays, Team& team, int jobs,
                  Model& model, Progress& progress, const InterruptGuard& interrupt) {
  progress.begin(overlay_stage);
  TeamSharing sharing(team, jobs, [&] { return interrupt.requested(); });
  model.overlay =
      condense_overlays(model, *description.overlay, overlays.centres, sharing, [&](double share) {
        progress.reach(share);
        return true;
      });
  return !interrupt.requested();
}

std::string interruption_text(const BakeOptions& options) {
  return fmt::format(
      "interrupted: the columns that are done are kept in {}{}; the same command goes on from there, "
      "with --discard it begins anew",
      options.output.string(), options.part ? "" : ".partial");
}

void check_touchable(const Surface& surface, const Model& model, const Description& description) {
  if (std::none_of(surface.nodes.begin(), surface.nodes.end(),
                   [&](Index node) { return model.fixed[static_cast<std::size_t>(node)] == 0; })) {
    throw Error("no node of the boundary is free along every axis, so nothing can be touched",
                description.file.string(), "Hold a smaller part of the body in [[fixed]]");
  }
}

/// Path that the model may be written to; checked before any work.
std::filesystem::path check_output(const Description& description, const BakeOptions& options) {
  OutputPaths paths(options.force, options.keep);
  if (!options.report.empty() && options.report != "-")
    paths.add(options.report, OutputKind::report, "--report");
  paths.add_input(description.file, "the description");
  for (const auto& file : input_files(description)) paths.add_input(file, "the geometry");
  for (const auto& part : options.parts) paths.add_input(part, "a part");
  return paths.add(options.output, OutputKind::model, "--output");
}

/// The options with the paths to read and write, as checked by the leader.
BakeOptions with_paths(const Description& description, const BakeOptions& asked, Team& team) {
  BakeOptions options = asked;
  if (options.join) options.parts = find_parts(options.output, options.parts);
  if (options.part) {
    expect_ending(options.output, OutputKind::model, "the model (--output)");
    options.output = part_path(options.output, options.part->number, options.part->parts);
  }
  if (options.dry_run) return options;
  const auto output = team.leads() ? check_output(description, options) : std::filesystem::path();
  options.output = team.share(output.string());
  return options;
}

/// The requested part: the same columns of all matrices.
std::optional<BakePart> planned_part(const BakeOptions& options, const Plans& plans,
                                     const GreensSolver& solver) {
  if (!options.part) return {};
  const auto [number, parts] = *options.part;
  const PieceRange pieces =
      share_of(plans.compression ? near_tiles(plans.compression->frame) : column_tiles(solver, plans.plan),
               number, parts);
  const bool two = plans.dynamics.method == DynamicsMethod::packed;
  return BakePart{number, parts, std::vector<PieceRange>(two ? 2 : 1, pieces)};
}

/// Lock on the output's journal from the start of the run, so that a second run is refused before it does the
/// work that precedes the columns. A journal left empty is removed.
class Claim {
 public:
  /// Throws Error if another process holds the lock.
  Claim(const std::filesystem::path& output, InterruptGuard& interrupt)
      : path_(output.string() + ".progress"), journal_(std::in_place, path_) {
    interrupt.remove_if_empty(path_);
  }
  ~Claim() {
    std::error_code none;
    if (journal_ && std::filesystem::file_size(path_, none) == 0 && !none) journal_->remove();
  }
  Claim(const Claim&) = delete;
  Claim& operator=(const Claim&) = delete;

  /// Releases the journal to the writer.
  void hand_over() { journal_.reset(); }

 private:
  std::string path_;
  std::optional<Journal> journal_;
};

/// Creates or continues the file: a part's own, the leader's, or the one that the leader has begun.
std::unique_ptr<ModelWriter> open_writer(const BakeOptions& options, const std::optional<BakePart>& part,
                                         const Model& model, Precision precision, bool of_parts, Team& team) {
  const Leftovers leftovers = options.discard ? Leftovers::discard : Leftovers::resume;
  if (part) return std::make_unique<ModelWriter>(options.output, model, precision, leftovers, *part);
  if (!team.leads())
    return std::make_unique<ModelWriter>(options.output, model, precision, team.share(""),
                                         [&team](const std::string& line) { team.tell(line); });
  auto writer = std::make_unique<ModelWriter>(options.output, model, precision, leftovers);
  if (of_parts)
    for (const auto& path : options.parts) writer->add_part(path);
  team.share(writer->journal_text());
  team.listen([&to = *writer](const std::string& line) { to.note(line); });
  return writer;
}

/// A bake: its stages and their common data.
class Bake {
 public:
  Bake(const Description& description, const BakeOptions& options, Team& team, Progress& progress,
       InterruptGuard& interrupt)
      : description_(description),
        options_(options),
        team_(team),
        progress_(progress),
        interrupt_(interrupt) {
    if (!options.dry_run && (options.part || team.leads())) claim_.emplace(options.output, interrupt);
  }

  BakeResult run() {
    if (description_.scope == Scope::none) return write_without_greens();
    assemble();
    if (options_.dry_run) return BakeResult::planned;
    progress_.plan(stages_of(plans_, options_.jobs, team_.size()));
    progress_.begin(factor_stage);
    factor_->factorize();
    if (const SpreadNumbers* numbers = factor_->spread_numbers(); numbers != nullptr) {
      spread_ = numbers->memory();
      progress_.line(fmt::format("factor over {} ranks: {}; {} % of work space beyond the estimate",
                                 team_.size(), text_of(*spread_, true), spread_->room));
    }
    // ranks stop together
    interrupt_.note_from_now_on(team_.size() > 1 ? "" : interruption_text(options_));
    if (has_fallen_back()) fall_back("as an earlier run has found, they cannot be compressed this exactly");
    try {
      return describe_and_solve();
    } catch (const OutOfReach& error) {
      if (description_.form != StorageForm::automatic) throw;
      foretold_ = expected_memory(plans_.plan);
      fall_back(error.what());
    }
    return describe_and_solve();
  }

  [[nodiscard]] const Plan& plan() const { return plans_.plan; }
  /// Largest planned memory of all attempts [byte].
  [[nodiscard]] std::int64_t foretold() const { return std::max(foretold_, expected_memory(plans_.plan)); }
  [[nodiscard]] const TileCounts& tiles() const { return tiles_; }
  [[nodiscard]] const std::optional<SpreadMemory>& spread() const { return spread_; }
  [[nodiscard]] bool compressed() const { return plans_.compression.has_value(); }
  [[nodiscard]] const std::string& fell_back() const { return fell_back_; }

 private:
  BakeResult write_without_greens();
  MeshedBody mesh();
  void assemble();
  void spread_where_needed(int ranks);
  [[nodiscard]] bool has_fallen_back();
  void fall_back(const std::string& why);
  BakeResult describe_and_solve();
  bool describe();
  bool take_up();
  std::optional<Solved> solve(ModelWriter& writer);

  const Description& description_;
  const BakeOptions& options_;
  Team& team_;
  Progress& progress_;
  InterruptGuard& interrupt_;
  std::optional<Claim> claim_;

  Model model_;
  std::optional<ElasticBody> elastic_;
  Stiffness stiffness_;
  std::vector<Vec3> loads_, prescribed_;
  std::string warning_;
  std::vector<std::uint8_t> stored_;
  std::unique_ptr<Factor> factor_;
  std::optional<GreensSolver> solver_;
  Plans plans_;
  std::optional<BakePart> part_;
  StoredNumbering stored_as_;
  Precision precision_ = Precision::single_precision;
  TileCounts tiles_;
  std::optional<SpreadMemory> spread_;  // of a factor over several processes
  std::string fell_back_;               // reason for not compressing
  std::int64_t foretold_ = 0;           // of a compression that was out of reach
};

MeshedBody Bake::mesh() {
  MeshedBody body = mesh_body(
      description_, [&](const std::string& text) { progress_.begin(text); }, options_.keep);
  for (const std::string& note : body.notes) progress_.line("note: " + note);
  for (const std::string& doubt : body.doubts) progress_.line("warning: " + doubt);
  if (!can_seal() && !input_files(description_).empty())
    progress_.line(
        "note: this system cannot seal processes (seccomp): those that read the geometry's file may do what "
        "this program may");
  warning_ = body.warning;
  return body;
}

/// Writes mesh, materials and loads, for solvers that need no Green's functions. Solves nothing: the rest
/// state has only the displacements of held nodes.
BakeResult Bake::write_without_greens() {
  if (options_.part || options_.join) {
    throw Error("scope \"none\" has no columns to share between parts", description_.file.string(),
                "leave out --part and --join, or set another scope in [storage]");
  }
  MeshedBody body = mesh();
  const std::vector<Vec3> loads = nodal_loads(description_, body);
  const std::vector<Vec3> prescribed = body.prescribed;
  model_ = describe_model(description_, options_, std::move(body));
  model_.rest_force = loads;
  if (!prescribed.empty()) model_.rest_displacement = prescribed;
  progress_.line(fmt::format("{} nodes, {} elements ({}); no Green's functions", model_.mesh.nodes.size(),
                             model_.mesh.elements(), traits(model_.mesh.element).name));
  if (options_.dry_run) return BakeResult::planned;
  if (!team_.leads()) return BakeResult::done;
  progress_.begin(write_stage);
  claim_->hand_over();
  ModelWriter(options_.output, model_, precision_, Leftovers::discard).finish({}, nullptr, options_.keep);
  progress_.line(fmt::format("{} written", options_.output.string()));
  if (!warning_.empty()) progress_.warn(warning_);
  return BakeResult::done;
}

/// Makes mesh, K and the plan.
void Bake::assemble() {
  MeshedBody body = mesh();
  progress_.begin("assembling K");
  loads_ = nodal_loads(description_, body);
  prescribed_ = body.prescribed;
  const Surface surface = body.surface;
  model_ = describe_model(description_, options_, std::move(body));
  elastic_.emplace(elastic_body(model_));
  elastic_->prescribed = prescribed_;
  stiffness_ = assemble_stiffness(*elastic_);
  take_blas_room(options_.jobs);
  openblas_set_num_threads(1);  // blocks of columns are the parallel work: the bytes do not depend on `jobs`
  progress_.begin("ordering K");
  factor_ = std::make_unique<Factor>(stiffness_.K, stiffness_.node_start);
  stored_ = stored_dof_marks(model_.mesh, surface, stiffness_, description_.scope, description_.layers);
  solver_.emplace(*factor_, stored_, stiffness_.free_dofs, model_.dimension());
  check_touchable(surface, model_, description_);
  plans_ = announce_plans(description_, options_, model_, stiffness_, *factor_, *solver_, progress_);
  const int ranks = options_.ranks > 0 ? options_.ranks : team_.size();
  spread_where_needed(ranks);
  if (ranks > 1)
    progress_.line(ranks_text(plans_, column_tiles(*solver_, plans_.plan), options_.jobs, ranks));
  if (!warning_.empty()) progress_.warn(warning_);
  check_memory(plans_.plan, team_.size_here());
  part_ = planned_part(options_, plans_, *solver_);
}

/// Distributes the factor over all processes if requested, or if one of them cannot hold it.
void Bake::spread_where_needed(int ranks) {
  if (options_.spreading == Spreading::never) return;
  if (options_.spreading == Spreading::where_needed &&
      (!team_.can_spread() || !team_.any(needs_more_memory(plans_.plan, team_.size_here()))))
    return;
  spread_ = expected_spread_memory(*factor_, ranks);
  if (ranks == team_.size() || !options_.dry_run) {
    factor_->spread(team_.spread(stiffness_.K, *factor_, options_.jobs));
    spread_ = factor_->spread_numbers()->memory();
  }
  spread_plan(*spread_, stiffness_.K.nonZeros(), ranks, options_.jobs, plans_.plan);
  progress_.line(fmt::format("factor over {} rank{} by MUMPS: about {}", ranks, ranks == 1 ? "" : "s",
                             text_of(*spread_, false)));
}

/// True if an interrupted run of the same description had already fallen back.
bool Bake::has_fallen_back() {
  if (!plans_.compression || description_.form != StorageForm::automatic || options_.part || options_.discard)
    return false;
  bool has = false;
  if (team_.leads()) {
    const auto begun = read_begun_model(options_.output.string() + ".partial");
    const auto same = [](const SourceFile& a, const SourceFile& b) {
      return a.path == b.path && a.checksum == b.checksum;
    };
    has = begun && begun->is_packed &&
          std::equal(begun->model.sources.begin(), begun->model.sources.end(), model_.sources.begin(),
                     model_.sources.end(), same);
  }
  return !team_.share(has ? "packed" : "").empty();
}

/// Continues with every entry after "auto" has found compression out of reach.
void Bake::fall_back(const std::string& why) {
  fell_back_ = why;
  progress_.line("note: compression = \"auto\" stores every entry of these Green's functions: " + why +
                 (options_.parts.empty() ? "" : "; the parts have compressed ones and are of no use here"));
  plans_.compression.reset();
  model_.compressed.reset();
  const Plan compressed = std::exchange(plans_.plan, plans_.packed);
  plans_.plan.overlay_bytes = compressed.overlay_bytes;
  plans_.plan.dynamics_bytes = compressed.dynamics_bytes;
  if (spread_) spread_plan(*spread_, stiffness_.K.nonZeros(), team_.size(), options_.jobs, plans_.plan);
  announce_greens(plans_, model_, description_, progress_);
  print_memory(plans_.plan, options_, false, progress_);
  check_memory(plans_.plan, team_.size_here());
  std::vector<Stage> stages = stages_of(plans_, options_.jobs, team_.size());
  stages.erase(stages.begin());  // there is a factor
  progress_.plan(std::move(stages));
}

/// Computes everything in the model that precedes the columns. Returns false if interrupted.
bool Bake::describe() {
  stored_as_ = plans_.compression ? plans_.compression->stored
                                  : number_stored(*solver_, stiffness_, model_.dimension());
  model_.stored_nodes = stored_as_.nodes;
  model_.rest_force = loads_;
  model_.rest_displacement = rest_displacement(*factor_, stiffness_, loads_, prescribed_, model_.dimension());
  if (const std::string warning = rest_warning(model_); !warning.empty()) progress_.warn(warning);
  if (plans_.compression)
    model_.compressed = std::make_shared<const HierarchicalMatrix>(plans_.compression->frame);
  const bool whole = !description_.overlay || add_overlays(description_, plans_.overlays, team_,
                                                           options_.jobs, model_, progress_, interrupt_);
  if (team_.any(!whole)) return false;
  if (take_up()) return true;
  if (!add_dynamics(description_, plans_.dynamics, *elastic_, stiffness_, *factor_, stored_as_.dofs, team_,
                    options_.jobs, model_, progress_, interrupt_))
    return false;
  if (!add_warp(description_, team_, model_, progress_, interrupt_)) return false;
  if (!plans_.compression) {
    progress_.begin(precision_stage);
    precision_ = decide_precision(description_, *elastic_, stiffness_, *factor_, stored_as_.dofs, team_,
                                  options_.jobs, model_, progress_);
  }
  return true;
}

/// Takes over the results that precede the columns from an interrupted run; returns true if there are any.
bool Bake::take_up() {
  if (options_.part || options_.join || options_.discard) return false;
  std::optional<Precision> left;
  if (team_.leads()) left = take_up_begun_model(options_.output, model_);
  if (team_.share(left ? "left" : "").empty()) return false;
  if (!team_.leads()) left = take_up_begun_model(options_.output, model_);
  if (!left) {
    throw Error("is not the file that another rank has found: the nodes do not share this folder",
                options_.output.string() + ".partial",
                "Write to a folder that all nodes share, or bake in parts: palpate-precompute --part K/N");
  }
  precision_ = *left;
  progress_.line("what comes before the columns is kept from an earlier run");
  return true;
}

std::optional<Solved> Bake::solve(ModelWriter& writer) {
  const Shared run{options_.jobs, team_, progress_, tiles_, [&] { return interrupt_.requested(); }};
  if (plans_.compression) return solve_compressed(*plans_.compression, *factor_, part_, run, writer);
  std::optional<Solved> solved = solve_matrices(description_, *elastic_, stiffness_, std::move(factor_),
                                                *solver_, stored_, plans_, part_, run, writer);
  if (solved) see_all(team_, writer, team_.leads());
  return solved;
}

BakeResult Bake::describe_and_solve() {
  if (!describe()) {
    progress_.line("interrupted: nothing was written");
    return BakeResult::interrupted;
  }
  if (claim_) claim_->hand_over();
  const std::unique_ptr<ModelWriter> writer =
      open_writer(options_, part_, model_, precision_, fell_back_.empty(), team_);
  model_.overlay = {};  // written by now
  model_.dynamics = {};
  ::malloc_trim(0);  // workspaces are too large for the gaps that small allocations leave
  std::optional<Solved> solved;
  try {
    solved = solve(*writer);
  } catch (const OutOfReach&) {
    writer->discard();
    throw;
  }
  if (!solved) {
    progress_.line(interruption_text(options_));
    return BakeResult::interrupted;
  }
  if (part_) {
    progress_.line(fmt::format("part {} of {} written: {} and {}.progress", part_->number, part_->parts,
                               options_.output.string(), options_.output.filename().string()));
    return BakeResult::part_done;
  }
  if (!team_.leads()) return BakeResult::done;
  progress_.begin(write_stage);
  writer->finish(solved->probes, solved->compressed, options_.keep);
  progress_.line(fmt::format("{} written", options_.output.string()));
  if (!options_.keep_parts) remove_parts(options_.parts);
  if (!warning_.empty()) progress_.warn(warning_);
  return BakeResult::done;
}

}  // namespace

BakeResult bake(const Description& description, const BakeOptions& options) {
  Team alone;
  return bake(description, options, alone).result;
}

BakeSummary bake(const Description& description, const BakeOptions& asked, Team& team) {
  InterruptGuard interrupt;
  const BakeOptions options = with_paths(description, asked, team);
  Progress progress(team.prints());
  if (const std::string note = kernels_in_use().note; !note.empty()) progress.line("note: " + note);
  Bake bake(description, options, team, progress, interrupt);
  BakeSummary summary{.model = description.file.string(),
                      .output = options.output,
                      .part = options.part,
                      .jobs = options.jobs};
  summary.result = bake.run();
  progress.end();
  summary.plan = bake.plan();
  summary.foretold = bake.foretold();
  summary.tiles = bake.tiles();
  summary.spread = bake.spread();
  summary.stages = progress.stages();
  summary.compressed = bake.compressed();
  summary.fell_back = bake.fell_back();
  return summary;
}

}  // namespace palpate
