// Green's functions in nested low-rank form: decision, plan, compression and certificate.
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

/// Stored nodes in the order of a file: the mesh node of each, and the dof of K of each of their dofs, -1 if
/// held.
struct StoredNumbering {
  std::vector<Index> nodes;
  std::vector<std::int64_t> dofs;
};

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

/// Stages of `compress_greens`, with the expected seconds.
std::vector<Stage> compression_stages(const CompressionPlan& plan, int ranks = 1);

/// Leaves of near pairs; their cost is the number of their entries.
std::vector<Tile> near_tiles(const HierarchicalMatrix& frame);

/// Compression of the Green's functions of a plan.
class GreensCompressor {
 public:
  /// Keeps references to all arguments.
  GreensCompressor(const CompressionPlan& plan, const Factor& factor, Team& team, int jobs,
                   Progress& progress, std::function<bool()> interrupted);

  /// Solves for the near pairs of the leaves of `part` that the writer does not have yet, and writes them.
  /// Adds to `counts`. Returns false if interrupted.
  bool solve_near(const PieceRange& part, ModelWriter& writer, TileCounts& counts);

  /// Computes the matrix, in all processes, from the near pairs of the file, which must be complete, and
  /// measures random touches; if their force errors exceed the tolerance, repeats with more terms. Returns
  /// null if interrupted. Throws OutOfReach, in all processes, if the tolerance cannot be met.
  std::shared_ptr<const HierarchicalMatrix> compress(ModelWriter& writer);

 private:
  bool reach(const char* stage, double share);

  const CompressionPlan& plan_;
  const Factor& factor_;
  Team& team_;
  Progress& progress_;
  std::function<bool()> interrupted_;
  TeamSharing sharing_;
  const char* stage_ = nullptr;  // current stage
  Compression compression_;
};

/// Certificate as a table, one line per number of nodes.
std::string certificate_text(const HierarchicalMatrix& matrix);

}  // namespace palpate
