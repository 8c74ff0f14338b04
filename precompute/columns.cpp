#include "precompute/columns.h"

#include <fmt/format.h>

#include <algorithm>

namespace palpate {

const char* column_stage(PackedMatrix matrix) {
  return matrix == PackedMatrix::greens ? "Green's functions" : "inverse of K_bar";
}

std::vector<Tile> column_tiles(const GreensSolver& solver, const Plan& plan) {
  std::vector<Tile> tiles;
  for (std::int64_t first = 0; first < plan.stored_dofs; first += plan.block_columns) {
    const std::int64_t count = std::min(plan.block_columns, plan.stored_dofs - first);
    tiles.push_back({first, count, solver.flops(first, count)});
  }
  return tiles;
}

bool solve_columns(const GreensSolver& solver, const Plan& plan, const PieceRange& part, int jobs, Team& team,
                   ModelWriter& writer, PackedMatrix matrix, Progress& progress, TileCounts& counts,
                   const std::function<bool()>& interrupted) {
  const std::string name = column_stage(matrix);
  std::vector<Tile> tiles;
  std::int64_t kept = 0;  // columns that an earlier, unfinished run has left
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
  const TileWork work = {[&](const Tile& tile, int worker) {
                           auto& [workspace, packed] = scratch[static_cast<std::size_t>(worker)];
                           ColumnShare own{tile.first, tile.count};
                           if (spread == nullptr) {
                             solver.columns(tile.first, tile.count, workspace, packed);
                           } else {
                             own = spread->columns(dofs, tile.first, tile.count, packed);
                           }
                           if (own.count > 0) writer.write_columns(own.first, own.count, packed, matrix);
                         },
                         [&](const Tile& tile) {
                           done += tile.cost;
                           ++counts.solved;
                           progress.reach(done / cost);
                         },
                         interrupted};
  return spread == nullptr ? team.work(tiles, jobs, work) : team.work_together(tiles, work);
}

}  // namespace palpate
