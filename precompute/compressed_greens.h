// Green's functions in nested low-rank form: when, what they take, and how they are made and judged.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "formats/model.h"
#include "formats/writer/model_writer.h"
#include "precompute/compression/certificate.h"
#include "precompute/compression/compression.h"
#include "precompute/description/description.h"
#include "precompute/numerics/factor.h"
#include "precompute/plan.h"
#include "precompute/progress.h"
#include "precompute/team.h"
#include "precompute/team_sharing.h"

namespace palpate {

/// Stored nodes in the order of a file: mesh node of each, and dof of K of each of their dofs, -1 where held.
struct StoredNumbering {
  std::vector<Index> nodes;
  std::vector<std::int64_t> dofs;
};

/// Whether the description asks for compressed Green's functions of so many nodes. Throws Error where it asks
/// for what does not go together.
bool wants_compression(const Description& description, std::int64_t stored_nodes);

/// What is decided before anything is solved.
struct CompressionPlan {
  ClusteredNodes clusters;
  StoredNumbering stored;         ///< in the order of the clusters
  TouchablePoints places;         ///< of the stored nodes
  HierarchicalMatrix frame;       ///< tree, pairs and tolerance
  std::int64_t far_bytes = 0;     ///< of bases and couplings, estimated
  std::int64_t memory_bytes = 0;  ///< beside the factor
  double near_seconds = 0.0, sample_seconds = 0.0, far_seconds = 0.0, touch_seconds = 0.0;  ///< estimates
};

/// `model`: mesh, surface and held nodes. `factor` may be only analysed. `dense` is the plan of all columns,
/// of which the rate of this machine is taken.
CompressionPlan plan_compression(const Description& description, const Model& model,
                                 const StoredNumbering& stored, const Factor& factor, const Plan& dense,
                                 int jobs);

/// The stages of `compress_greens`, with the seconds that they are expected to take.
std::vector<Stage> compression_stages(const CompressionPlan& plan, int ranks = 1);

/// Leaves of near pairs, whose cost is the number of their entries.
std::vector<Tile> near_tiles(const HierarchicalMatrix& frame);

/// How the Green's functions of a plan are made.
class GreensCompressor {
 public:
  /// All are kept by reference.
  GreensCompressor(const CompressionPlan& plan, const Factor& factor, Team& team, int jobs,
                   Progress& progress, std::function<bool()> interrupted);

  /// Solves for the near pairs of the leaves of `part` that the writer does not have yet, and writes them.
  /// Adds to `counts`. False when interrupted.
  bool solve_near(const PieceRange& part, ModelWriter& writer, TileCounts& counts);

  /// Makes the matrix, in all processes, with the near pairs of the file, which has all, and measures random
  /// touches; where their forces are off by more than the tolerance, again with more terms. Null when
  /// interrupted. Throws OutOfReach, in all processes, where the tolerance is.
  std::shared_ptr<const HierarchicalMatrix> compress(ModelWriter& writer);

 private:
  bool reach(const char* stage, double share);

  const CompressionPlan& plan_;
  const Factor& factor_;
  Team& team_;
  Progress& progress_;
  std::function<bool()> interrupted_;
  TeamSharing sharing_;
  const char* stage_ = nullptr;  // under way
  Compression compression_;
};

/// The certificate as a table, a line for each number of nodes.
std::string certificate_text(const HierarchicalMatrix& matrix);

}  // namespace palpate
