// The packed matrices of a bake: their precision, and their columns.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "formats/writer/model_writer.h"
#include "precompute/assembled_body.h"
#include "precompute/bake_run.h"
#include "precompute/plan.h"
#include "precompute/team.h"

namespace palpate {

/// Results computed after the file is begun.
struct Solved {
  std::vector<Probe> probes;
  std::shared_ptr<const HierarchicalMatrix> compressed;
};

inline constexpr const char* inverse_factor_stage = "factorising K_bar";

/// Name of the stage in which the columns of a matrix are solved.
const char* column_stage(PackedMatrix matrix);

/// Columns that are solved together, independent of the numbers of jobs, parts and processes, and so are the
/// bytes. Costs in flops.
std::vector<Tile> column_tiles(const GreensSolver& solver, const Plan& plan);

/// Pieces of a matrix that arrive in a file in any order.
struct Pieces {
  const char* stage;  ///< name
  const char* whose;  ///< "those of ", where they are counted by something else
  const char* of;     ///< "columns"
  double seconds;     ///< expected for all of them
  std::function<bool(const Tile&)> has;
  std::function<void(const Tile&, int worker)> solve;  ///< `worker` in [0, run.jobs)
};

/// Solves the tiles of `part` that the file does not have yet. False when interrupted.
bool solve_pieces(const BakeRun& run, const std::vector<Tile>& tiles, const PieceRange& part,
                  const Pieces& pieces);

/// Random forces on all stored dofs, in [-1, 1) N (those on held dofs have no effect), and their
/// displacements by a plain solve, independent of the columns.
std::vector<Probe> make_probes(const Factor& factor, const std::vector<std::int64_t>& stored_dofs);

/// Chooses the precision of all packed matrices and sets their smooth parts and force errors in the model.
Precision decide_precision(const BakeRun& run, const AssembledBody& body, const Factor& factor,
                           const std::vector<std::int64_t>& stored_dofs, Model& model);

/// Computes the columns of the packed matrices, of a part or all, and the leader the probes of the first one;
/// `inverse`: there are two matrices. Nothing when interrupted.
std::optional<Solved> solve_matrices(const BakeRun& run, const AssembledBody& body,
                                     std::unique_ptr<Factor> factor, const Plan& plan,
                                     const std::optional<BakePart>& part, bool inverse, ModelWriter& writer);

}  // namespace palpate
