// Columns of the packed matrices, divided into tiles and parts.
#pragma once

#include <functional>
#include <vector>

#include "formats/writer/model_writer.h"
#include "precompute/numerics/greens_solver.h"
#include "precompute/plan.h"
#include "precompute/progress.h"
#include "precompute/team.h"

namespace palpate {

/// Name of the stage in which the columns of a matrix are solved.
const char* column_stage(PackedMatrix matrix);

/// Columns that are solved together, independent of the numbers of jobs, parts and processes, and so are the
/// bytes. Costs in flops.
std::vector<Tile> column_tiles(const GreensSolver& solver, const Plan& plan);

/// Computes the columns of a packed matrix, of `part` or all, that the file does not have yet, and adds to
/// `counts`. Returns false if interrupted.
bool solve_columns(const GreensSolver& solver, const Plan& plan, const PieceRange& part, int jobs, Team& team,
                   ModelWriter& writer, PackedMatrix matrix, Progress& progress, TileCounts& counts,
                   const std::function<bool()>& interrupted);

}  // namespace palpate
