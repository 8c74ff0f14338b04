// Xi in nested low-rank form, computed from the factor without forming all of Xi.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "matrices/hierarchical.h"
#include "precompute/compression/block_solver.h"
#include "precompute/compression/cluster_pairs.h"
#include "precompute/compression/far_pairs.h"
#include "precompute/compression/selected_solver.h"
#include "precompute/numerics/factor.h"
#include "precompute/numerics/sharing.h"

namespace palpate {

/// Stages of a compression.
enum class CompressionStage : std::uint8_t { near, samples, far };

/// Called with the finished fraction of a stage; returns false to stop.
using CompressionProgress = std::function<bool(CompressionStage, double)>;

/// Provides the entries of the near pairs with leaf [0, leaves) as column, as computed by `solve_near`.
/// Called by several threads at once, for each leaf in one of the processes that divide the work.
using FetchNear = std::function<void(Index leaf, std::span<float> entries)>;

/// Xi of the stored dofs as a HierarchicalMatrix.
///
/// Near pairs are entries of Xi, exact except for their rounding to single. For each cluster some dofs, its
/// skeleton, are chosen by a pivoted QR of the response to random loads on everything far from it; the rows
/// of V express the other dofs by them. The coupling of a far pair is then the block of Xi between two
/// skeletons. The response to near loads is subtracted by means of the near pairs and, going up the tree, of
/// the couplings of each level, so that the same random loads serve all levels (Boukaram and others, arXiv
/// 2506.16759). Bases and couplings, which are finer than needed until then, are recompressed at the end. The
/// result does not depend on how the work is divided.
class Compression {
 public:
  /// `stored_dofs` [d N] are dofs of K, d per node, in the order of `nodes`, -1 if held. `forward_bytes`:
  /// memory for forward solutions. Keeps references to all arguments.
  Compression(const Factor& factor, std::span<const std::int64_t> stored_dofs, int dimension,
              const ClusteredNodes& nodes, Sharing& sharing, std::int64_t forward_bytes,
              CompressionProgress progress);
  Compression(const Compression&) = delete;
  Compression& operator=(const Compression&) = delete;

  /// Solves for the near pairs with leaf [0, leaves) as column: pair after pair, resized. Called by thread
  /// `worker` in [0, jobs), for different leaves at once, before `prepare`.
  void solve_near(Index leaf, int worker, std::vector<float>& entries);

  /// Takes the near pairs from `fetch`, or solves for them, and solves for random loads. Returns false if
  /// `progress` stopped it. Throws OutOfReach if near pairs are indefinite in single precision.
  bool prepare(const FetchNear& fetch = {});

  /// The matrix, truncated where rows of L^-1 Xi L^-T, with L the Cholesky factors of the leaves, change by
  /// at most `cut` under random loads of +-1 on everything far (see `recompressed`). After `prepare`, for any
  /// number of cuts. Null if `progress` stopped it. Throws OutOfReach if a rank exceeds what the random loads
  /// can resolve.
  std::shared_ptr<HierarchicalMatrix> compress(double cut);

 private:
  [[nodiscard]] std::int64_t near_begin(Index leaf) const;
  void solve_near_of(Index leaf, int worker, std::span<float> entries);
  bool gather_near(const FetchNear& fetch);
  bool sample();
  void try_single();
  void check(HierarchicalMatrix& matrix) const;
  [[nodiscard]] Eigen::VectorXd weighed_rows(DoubleRows u) const;

  SelectedSolver solver_;
  std::span<const std::int64_t> stored_dofs_;
  Sharing& sharing_;
  CompressionProgress progress_;
  HierarchicalMatrix matrix_;                                      // without far pairs
  Eigen::VectorXd root_;                                           // [order] root of D, 0 where held
  DoubleRows response_, load_;                                     // [order x (random_loads + checks)]
  double single_error_ = std::numeric_limits<double>::infinity();  // [-] of a leaf, root mean square
  std::int64_t forward_bytes_;
  std::unique_ptr<BlockSolver<double>> near_solver_;
};

/// Tree and pairs of a matrix that is yet to be computed.
HierarchicalMatrix compression_frame(const ClusteredNodes& nodes, int dimension);

/// Estimated multiplications and additions for the near pairs, from some of the leaves.
double near_flops(const Factor& factor, std::span<const std::int64_t> stored_dofs,
                  const HierarchicalMatrix& frame);

/// Memory of one thread [byte].
std::int64_t compression_workspace(const Factor& factor, std::span<const std::int64_t> stored_dofs,
                                   const HierarchicalMatrix& frame);

/// Memory of solvers beside the factor: its diagonal blocks inverted, and its copy in single precision
/// [byte].
std::int64_t solver_bytes(const Factor& factor);

}  // namespace palpate
