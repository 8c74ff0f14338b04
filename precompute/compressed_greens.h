// Green's functions in nested low-rank form: decision, plan, compression and certificate.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "formats/model.h"
#include "precompute/columns.h"
#include "precompute/compression/certificate.h"
#include "precompute/compression/compression.h"

namespace palpate {

/// True if the description asks for compressed Green's functions with so many nodes. Throws Error for
/// contradictory settings.
bool wants_compression(const Description& description, std::int64_t stored_nodes);

/// Plan of a compression, made before anything is solved.
struct CompressionPlan {
  ClusteredNodes clusters;
  StoredNumbering stored;         ///< in the order of the clusters
  TouchablePoints places;         ///< of the stored nodes
  HierarchicalMatrix frame;       ///< tree, pairs and tolerance
  std::int64_t far_bytes = 0;     ///< of bases and couplings, estimated
  std::int64_t memory_bytes = 0;  ///< beside the factor
  double near_seconds = 0.0, sample_seconds = 0.0, far_seconds = 0.0, touch_seconds = 0.0;  ///< estimates
};

/// Plans a compression. `model`: mesh, surface and held nodes. `factor` may be only analysed. `dense` is the
/// plan of all columns, which has this machine's rate.
CompressionPlan plan_compression(const Description& description, const Model& model,
                                 const StoredNumbering& stored, const Factor& factor, const Plan& dense,
                                 int jobs);

/// The stages of `solve_compressed`, with the seconds that they are expected to take.
std::vector<Stage> compression_stages(const CompressionPlan& plan, int ranks = 1);

/// Leaves of near pairs; their cost is the number of their entries.
std::vector<Tile> near_tiles(const HierarchicalMatrix& frame);

/// Makes the Green's functions of a plan, in all processes, with near pairs that the file has or gets, and
/// measures random touches; where their forces are off by more than the tolerance, again with more terms. A
/// part has some of the near pairs, and that is all. Nothing when interrupted. Throws OutOfReach, in all
/// processes, where the tolerance is.
std::optional<Solved> solve_compressed(const BakeRun& run, const CompressionPlan& plan, const Factor& factor,
                                       const std::optional<BakePart>& part, ModelWriter& writer);

/// Makes data written by all processes, on any machine, visible to processes that read (`reads`). To the
/// others the file may already be complete and renamed.
void see_all(Team& team, ModelWriter& writer, bool reads);

/// Certificate as a table, one line per number of nodes.
std::string certificate_text(const HierarchicalMatrix& matrix);

}  // namespace palpate
