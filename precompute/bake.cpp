#include "precompute/bake.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "base/error.h"
#include "base/interrupt.h"
#include "formats/begun_model.h"
#include "formats/journal.h"
#include "formats/model_check.h"
#include "formats/outputs/output_paths.h"
#include "formats/outputs/part_files.h"
#include "formats/writer/model_writer.h"
#include "precompute/assembled_body.h"
#include "precompute/bake_plan.h"
#include "precompute/columns.h"
#include "precompute/compressed_greens.h"
#include "precompute/compression/out_of_reach.h"
#include "precompute/machine/blas_kernels.h"
#include "precompute/numerics/dynamics.h"
#include "precompute/numerics/loads.h"
#include "precompute/numerics/meshed_body.h"
#include "precompute/numerics/overlay_regions.h"
#include "precompute/progress.h"
#include "precompute/spread_plan.h"

namespace palpate {
namespace {

std::string interruption_text(const BakeOptions& options) {
  return fmt::format(
      "interrupted: the columns that are done are kept in {}{}; the same command goes on from there, "
      "with --discard it begins anew",
      options.output.string(), options.part ? "" : ".partial");
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
std::unique_ptr<ModelWriter> open_writer(const BakeRun& run, const BakePlan& plan, const Model& model,
                                         Precision precision) {
  const BakeOptions& options = run.options;
  Team& team = run.team;
  const Leftovers leftovers = options.discard ? Leftovers::discard : Leftovers::resume;
  if (plan.part)
    return std::make_unique<ModelWriter>(options.output, model, precision, leftovers, *plan.part);
  if (!team.leads())
    return std::make_unique<ModelWriter>(options.output, model, precision, team.share(""),
                                         [&team](const std::string& line) { team.tell(line); });
  auto writer = std::make_unique<ModelWriter>(options.output, model, precision, leftovers);
  if (run.summary.fell_back.empty())
    for (const auto& path : options.parts) writer->add_part(path);
  team.share(writer->journal_text());
  team.listen([&to = *writer](const std::string& line) { to.note(line); });
  return writer;
}

/// Without Green's functions, for solvers that need none. Nothing is solved: the rest state is where held
/// nodes are.
BakeResult write_without_greens(const BakeRun& run, MeshedModel meshed, std::optional<Claim>& claim) {
  const BakeOptions& options = run.options;
  if (options.part || options.join) {
    throw Error("scope \"none\" has no columns to share between parts", run.description.file.string(),
                "leave out --part and --join, or set another scope in [storage]");
  }
  Model& model = meshed.model;
  model.rest_force = std::move(meshed.loads);
  if (!meshed.prescribed.empty()) model.rest_displacement = std::move(meshed.prescribed);
  run.progress.line(fmt::format("{} nodes, {} elements ({}); no Green's functions", model.mesh.nodes.size(),
                                model.mesh.elements(), traits(model.mesh.element).name));
  if (options.dry_run) return BakeResult::planned;
  if (!run.team.leads()) return BakeResult::done;
  run.progress.begin(write_stage);
  claim->hand_over();
  ModelWriter(options.output, model, Precision::single_precision, Leftovers::discard)
      .finish({}, nullptr, options.keep);
  run.progress.line(fmt::format("{} written", options.output.string()));
  if (!meshed.warning.empty()) run.progress.warn(meshed.warning);
  return BakeResult::done;
}

/// The computed factor of a body, by one process or all of them.
std::unique_ptr<Factor> factorised(const BakeRun& run, const BakePlan& plan, std::unique_ptr<Factor> factor) {
  run.progress.plan(stages_of(plan, run.jobs, run.team.size()));
  run.progress.begin(factor_stage);
  factor->factorize();
  if (const SpreadNumbers* numbers = factor->spread_numbers(); numbers != nullptr) {
    run.summary.spread = numbers->memory();
    run.progress.line(fmt::format("factor over {} ranks: {}; {} % of work space beyond the estimate",
                                  run.team.size(), text_of(*run.summary.spread, true),
                                  run.summary.spread->room));
  }
  // ranks stop together
  run.interrupt.note_from_now_on(run.team.size() > 1 ? "" : interruption_text(run.options));
  return factor;
}

/// True if an interrupted run of the same description had already fallen back.
bool has_fallen_back(const BakeRun& run, const BakePlan& plan, const Model& model) {
  if (!plan.compression || run.description.form != StorageForm::automatic || run.options.part ||
      run.options.discard)
    return false;
  bool has = false;
  if (run.team.leads()) {
    const auto begun = read_begun_model(run.options.output.string() + ".partial");
    const auto same = [](const SourceFile& a, const SourceFile& b) {
      return a.path == b.path && a.checksum == b.checksum;
    };
    has = begun && begun->is_packed &&
          std::equal(begun->model.sources.begin(), begun->model.sources.end(), model.sources.begin(),
                     model.sources.end(), same);
  }
  return !run.team.share(has ? "packed" : "").empty();
}

/// Condenses the overlays that the file is to keep. False, in all processes, when interrupted.
bool add_overlays(const BakeRun& run, const OverlayPlan& overlays, Model& model) {
  if (!run.description.overlay) return true;
  run.progress.begin(overlay_stage);
  TeamSharing sharing(run.team, run.jobs, run.interrupted);
  model.overlay =
      condense_overlays(model, *run.description.overlay, overlays.centres, sharing, [&](double share) {
        run.progress.reach(share);
        return true;
      });
  return !run.team.any(run.interrupted());
}

/// Each process by itself. False, in all, when interrupted.
bool add_dynamics(const BakeRun& run, const DynamicsPlan& plan, const AssembledBody& body,
                  const Factor& factor, const std::vector<std::int64_t>& stored_dofs, Model& model) {
  if (!run.description.dynamics) return true;
  const DynamicsOptions& options = *run.description.dynamics;
  if (plan.method == DynamicsMethod::modal) run.progress.begin(modes_stage);
  const bool in_step = factor.spread_numbers() != nullptr;  // no process may stop before the others
  std::optional<StoredDynamics> dynamics = describe_dynamics(
      options, plan, body.stiffness.K, assemble_mass(body.elastic, body.stiffness, options.lumped), factor,
      stored_dofs, [&] { return !in_step && run.interrupted(); });
  if (run.team.any(!dynamics)) return false;
  model.dynamics = *std::move(dynamics);
  return true;
}

/// The precision of an interrupted run that has left what comes before the columns, which the model takes.
std::optional<Precision> take_up(const BakeRun& run, Model& model) {
  const BakeOptions& options = run.options;
  if (options.part || options.join || options.discard) return {};
  std::optional<Precision> left;
  if (run.team.leads()) left = take_up_begun_model(options.output, model);
  if (run.team.share(left ? "left" : "").empty()) return {};
  if (!run.team.leads()) left = take_up_begun_model(options.output, model);
  run.team.any(!left);  // the leader goes on, and writes to the file, once all have read it
  if (!left) {
    throw Error("is not the file that another rank has found: the nodes do not share this folder",
                options.output.string() + ".partial",
                "Write to a folder that all nodes share, or bake in parts: palpate-precompute --part K/N");
  }
  run.progress.line("what comes before the columns is kept from an earlier run");
  return left;
}

/// Adds all to the model that is known before the columns. Returns their precision, nothing when interrupted.
std::optional<Precision> describe(const BakeRun& run, const BakePlan& plan, const AssembledBody& body,
                                  const Factor& factor, MeshedModel& meshed) {
  Model& model = meshed.model;
  const StoredNumbering stored = plan.compression ? plan.compression->stored : body.numbering();
  model.stored_nodes = stored.nodes;
  model.rest_force = meshed.loads;
  model.rest_displacement =
      rest_displacement(factor, body.stiffness, meshed.loads, meshed.prescribed, model.dimension());
  if (const std::string warning = rest_warning(model); !warning.empty()) run.progress.warn(warning);
  if (plan.compression)
    model.compressed = std::make_shared<const HierarchicalMatrix>(plan.compression->frame);
  if (!add_overlays(run, plan.overlays, model)) return {};
  if (const auto left = take_up(run, model)) return left;
  if (!add_dynamics(run, plan.dynamics, body, factor, stored.dofs, model)) return {};
  if (plan.compression) return Precision::single_precision;
  run.progress.begin(precision_stage);
  return decide_precision(run, body, factor, stored.dofs, model);
}

std::optional<Solved> solve(const BakeRun& run, const BakePlan& plan, const AssembledBody& body,
                            std::unique_ptr<Factor>& factor, ModelWriter& writer) {
  if (plan.compression) return solve_compressed(run, *plan.compression, *factor, plan.part, writer);
  const bool inverse = plan.dynamics.method == DynamicsMethod::packed;
  std::optional<Solved> solved =
      solve_matrices(run, body, std::move(factor), plan.plan, plan.part, inverse, writer);
  if (solved) see_all(run.team, writer, run.team.leads());
  return solved;
}

/// All that comes once there is a factor.
BakeResult describe_and_solve(const BakeRun& run, const BakePlan& plan, const AssembledBody& body,
                              std::unique_ptr<Factor>& factor, MeshedModel& meshed,
                              std::optional<Claim>& claim) {
  const BakeOptions& options = run.options;
  const std::optional<Precision> precision = describe(run, plan, body, *factor, meshed);
  if (!precision) {
    run.progress.line("interrupted: nothing was written");
    return BakeResult::interrupted;
  }
  if (claim) claim->hand_over();
  const std::unique_ptr<ModelWriter> writer = open_writer(run, plan, meshed.model, *precision);
  meshed.model.overlay = {};  // written by now
  meshed.model.dynamics = {};
  ::malloc_trim(0);  // workspaces are too large for the gaps that small allocations leave
  std::optional<Solved> solved;
  try {
    solved = solve(run, plan, body, factor, *writer);
  } catch (const OutOfReach&) {
    writer->discard();
    throw;
  }
  if (!solved) {
    run.progress.line(interruption_text(options));
    return BakeResult::interrupted;
  }
  if (plan.part) {
    run.progress.line(fmt::format("part {} of {} written: {} and {}.progress", plan.part->number,
                                  plan.part->parts, options.output.string(),
                                  options.output.filename().string()));
    return BakeResult::part_done;
  }
  if (!run.team.leads()) return BakeResult::done;
  run.progress.begin(write_stage);
  writer->finish(solved->probes, solved->compressed, options.keep);
  run.progress.line(fmt::format("{} written", options.output.string()));
  if (!options.keep_parts) remove_parts(options.parts);
  if (!meshed.warning.empty()) run.progress.warn(meshed.warning);
  return BakeResult::done;
}

BakeResult run_stages(const BakeRun& run) {
  std::optional<Claim> claim;
  if (!run.options.dry_run && (run.options.part || run.team.leads()))
    claim.emplace(run.options.output, run.interrupt);
  MeshedModel meshed = mesh_model(run);
  if (run.description.scope == Scope::none) return write_without_greens(run, std::move(meshed), claim);
  AssembledBody body(run, meshed);
  BakePlan plan = plan_bake(run, meshed, body);
  if (run.options.dry_run) return BakeResult::planned;
  std::unique_ptr<Factor> factor = factorised(run, plan, std::move(body.factor));
  if (has_fallen_back(run, plan, meshed.model)) {
    run.summary.foretold = 0;  // of a compression that is not begun
    fall_back(run, "as an earlier run has found, they cannot be compressed this exactly", body, meshed.model,
              plan);
  }
  try {
    return describe_and_solve(run, plan, body, factor, meshed, claim);
  } catch (const OutOfReach& error) {
    if (run.description.form != StorageForm::automatic) throw;
    fall_back(run, error.what(), body, meshed.model, plan);
  }
  return describe_and_solve(run, plan, body, factor, meshed, claim);
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
  BakeSummary summary{.model = description.file.string(),
                      .output = options.output,
                      .part = options.part,
                      .jobs = options.jobs};
  summary.result = run_stages({description, options, team, options.jobs, progress, interrupt,
                               [&] { return interrupt.requested(); }, summary});
  progress.end();
  summary.stages = progress.stages();
  return summary;
}

}  // namespace palpate
