#include "precompute/columns.h"

#include <fmt/format.h>

#include <algorithm>

#include "precompute/spread_plan.h"

namespace palpate {

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

bool solve_columns(const GreensSolver& solver, const Plan& plan, const PieceRange& part, int jobs, Team& team,
                   ModelWriter& writer, PackedMatrix matrix, Progress& progress, TileCounts& counts,
                   const std::function<bool()>& interrupted) {
  const std::string name = column_stage(matrix);
  std::vector<Tile> tiles;
  std::int64_t kept = 0;  // columns of an earlier, unfinished run
  double cost = 0.0;
  for (const Tile& tile : column_tiles(solver, plan)) {
    if (tile.first < part.first || tile.first >= part.end) continue;
    if (writer.has_columns(tile.first, tile.count, matrix)) {
      kept += tile.count;
      ++counts.kept;
    } else {
      cost += tile.cost;
      tiles.push_back(tile);
    }
  }
  if (kept > 0)
    progress.line(
        fmt::format("{}: {} of {} columns were kept from earlier runs", name, kept, part.end - part.first));
  if (cost < plan.flops) progress.expect(name, plan.seconds * cost / plan.flops);
  progress.begin(name);
  struct Scratch {
    GreensSolver::Workspace workspace;
    std::vector<double> packed;
  };
  std::vector<Scratch> scratch(static_cast<std::size_t>(jobs));
  SpreadNumbers* const spread = solver.factor().spread_numbers();
  const std::vector<std::int64_t> dofs =
      spread == nullptr ? std::vector<std::int64_t>() : solver.stored_dofs();
  double done = 0.0;
  TileWork work = {[&](const Tile& tile, int worker) {
                     auto& [workspace, packed] = scratch[static_cast<std::size_t>(worker)];
                     if (spread == nullptr) {
                       solver.columns(tile.first, tile.count, workspace, packed);
                     } else {
                       spread_columns(*spread, dofs, tile.first, tile.count, packed);
                     }
                     writer.write_columns(tile.first, tile.count, packed, matrix);
                   },
                   [&](const Tile& tile) {
                     done += tile.cost;
                     ++counts.solved;
                     progress.reach(done / cost);
                   },
                   interrupted};
  if (spread == nullptr) return team.work(tiles, jobs, work);
  return work_while_others_serve(*spread, team, interrupted, [&](const std::function<bool()>& by_any) {
    work.interrupted = by_any;
    constexpr int one_thread = 1;  // only one solves with all processes
    return Team().work(tiles, one_thread, work);
  });
}

}  // namespace palpate
