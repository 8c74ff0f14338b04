#include "precompute/columns.h"

#include <fmt/format.h>

#include <algorithm>
#include <random>
#include <stdexcept>

#include "precompute/numerics/precision.h"
#include "precompute/progress.h"
#include "precompute/spread_plan.h"

namespace palpate {
namespace {

constexpr int probe_count = 4;

SparseMatrix stiffness_of_step(const BakeRun& run, const AssembledBody& body) {
  const DynamicsOptions& options = *run.description.dynamics;
  return effective_stiffness(body.stiffness.K, assemble_mass(body.elastic, body.stiffness, options.lumped),
                             options.damping, options.newmark);
}

/// Computes the columns of a packed matrix that the file does not have yet. False when interrupted.
bool solve_columns(const BakeRun& run, const GreensSolver& solver, const Plan& plan, const PieceRange& part,
                   ModelWriter& writer, PackedMatrix matrix) {
  SpreadNumbers* const spread = solver.factor().spread_numbers();
  const std::vector<std::int64_t> dofs =
      spread == nullptr ? std::vector<std::int64_t>() : solver.stored_dofs();
  struct Scratch {
    GreensSolver::Workspace workspace;
    std::vector<double> packed;
  };
  std::vector<Scratch> scratch(static_cast<std::size_t>(run.jobs));
  const Pieces pieces = {column_stage(matrix),
                         "",
                         "columns",
                         plan.seconds,
                         [&](const Tile& tile) { return writer.has_columns(tile.first, tile.count, matrix); },
                         [&](const Tile& tile, int worker) {
                           auto& [workspace, packed] = scratch[static_cast<std::size_t>(worker)];
                           if (spread == nullptr) {
                             solver.columns(tile.first, tile.count, workspace, packed);
                           } else {
                             spread_columns(*spread, dofs, tile.first, tile.count, packed);
                           }
                           writer.write_columns(tile.first, tile.count, packed, matrix);
                         }};
  const std::vector<Tile> tiles = column_tiles(solver, plan);
  if (spread == nullptr) return solve_pieces(run, tiles, part, pieces);
  return work_while_others_serve(
      *spread, run, [&](const BakeRun& leader) { return solve_pieces(leader, tiles, part, pieces); });
}

/// Factorises K_bar and computes the columns of its inverse, numbered as those of Xi. Returns false if
/// interrupted.
bool solve_inverse(const BakeRun& run, const AssembledBody& body,
                   const std::vector<std::int64_t>& stored_dofs, const Plan& plan, const PieceRange& columns,
                   bool spread, ModelWriter& writer) {
  const SparseMatrix K_bar = stiffness_of_step(run, body);
  Factor factor(K_bar, body.stiffness.node_start);
  const GreensSolver solver(factor, body.stored, body.stiffness.free_dofs, body.elastic.mesh.dimension());
  if (solver.stored_dofs() != stored_dofs) {
    throw std::logic_error("K_bar and K, of one pattern, have different elimination orders");
  }
  if (writer.has_columns(columns.first, columns.end - columns.first, PackedMatrix::inverse)) return true;
  run.progress.begin(inverse_factor_stage);
  if (spread) factor.spread(run.team.spread(K_bar, factor, run.jobs));
  factor.factorize();
  return solve_columns(run, solver, plan, columns, writer, PackedMatrix::inverse);
}

}  // namespace

const char* column_stage(PackedMatrix matrix) {
  return matrix == PackedMatrix::greens ? "Green's functions" : "inverse of K_bar";
}

std::vector<Tile> column_tiles(const GreensSolver& solver, const Plan& plan) {
  std::vector<Tile> tiles;
  for (const PieceRange& block : column_blocks(plan)) {
    const std::int64_t count = block.end - block.first;
    tiles.push_back({block.first, count, solver.flops(block.first, count)});
  }
  return tiles;
}

bool solve_pieces(const BakeRun& run, const std::vector<Tile>& tiles, const PieceRange& part,
                  const Pieces& pieces) {
  std::vector<Tile> open;
  std::int64_t kept = 0;  // pieces that an earlier, unfinished run has left
  double cost = 0.0, whole = 0.0;
  for (const Tile& tile : tiles) {
    whole += tile.cost;
    if (tile.first < part.first || tile.first >= part.end) continue;
    if (pieces.has(tile)) {
      kept += tile.count;
      ++run.summary.tiles.kept;
    } else {
      cost += tile.cost;
      open.push_back(tile);
    }
  }
  if (kept > 0)
    run.progress.line(fmt::format("{}: {}{} of {} {} were kept from earlier runs", pieces.stage, pieces.whose,
                                  kept, part.end - part.first, pieces.of));
  if (cost < whole) run.progress.expect(pieces.stage, pieces.seconds * cost / whole);
  run.progress.begin(pieces.stage);
  double done = 0.0;
  return run.team.work(open, run.jobs,
                       {pieces.solve,
                        [&](const Tile& tile) {
                          done += tile.cost;
                          ++run.summary.tiles.solved;
                          run.progress.reach(done / cost);
                        },
                        run.interrupted});
}

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

Precision decide_precision(const BakeRun& run, const AssembledBody& body, const Factor& factor,
                           const std::vector<std::int64_t>& stored_dofs, Model& model) {
  std::vector<PrecisionStudy> studies;
  studies.emplace_back(model, factor, body.stiffness.K, stored_dofs);
  if (model.dynamics.method == DynamicsMethod::packed) {
    const SparseMatrix K_bar = stiffness_of_step(run, body);
    Factor factor_bar(K_bar, body.stiffness.node_start);
    if (factor.spread_numbers() != nullptr) factor_bar.spread(run.team.spread(K_bar, factor_bar, run.jobs));
    factor_bar.factorize();
    studies.emplace_back(model, factor_bar, K_bar, stored_dofs);
  }
  const PrecisionChoice choice = choose_precision(studies, run.description.precision);
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
  run.progress.line(fmt::format(
      "precision: {}{}; force errors: {}", name_of(choice.precision),
      model.greens.smooth() == nullptr ? "" : fmt::format(", {} smooth terms", model.greens.smooth()->terms),
      errors_text(choice.errors)));
  if (const std::string warning = precision_warning(model, choice.precision); !warning.empty())
    run.progress.warn(warning);
  return choice.precision;
}

std::optional<Solved> solve_matrices(const BakeRun& run, const AssembledBody& body,
                                     std::unique_ptr<Factor> factor, const Plan& plan,
                                     const std::optional<BakePart>& part, bool inverse, ModelWriter& writer) {
  const std::vector<std::int64_t> stored_dofs = body.solver.stored_dofs();
  const PieceRange columns = part ? part->pieces.front() : PieceRange{0, plan.stored_dofs};
  if (!solve_columns(run, body.solver, plan, columns, writer, PackedMatrix::greens)) return {};
  Solved solved;
  const bool spread = factor->spread_numbers() != nullptr;
  if ((run.team.leads() || spread) && !part) solved.probes = make_probes(*factor, stored_dofs);
  if (inverse) {
    factor.reset();  // frees its memory for the factor of K_bar
    if (!solve_inverse(run, body, stored_dofs, plan, columns, spread, writer)) return {};
  }
  return solved;
}

}  // namespace palpate
