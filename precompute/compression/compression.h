// Xi in nested low-rank form, from the factor, without ever having all of it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "matrices/hierarchical.h"
#include "precompute/compression/cluster_pairs.h"
#include "precompute/numerics/factor.h"
#include "precompute/numerics/sharing.h"

namespace palpate {

/// Loads that act on the whole body.
inline constexpr Index random_loads = 256;

/// The parts that a compression has.
enum class CompressionStage : std::uint8_t { near, samples, far };

/// Told which share of a part is done; false stops.
using CompressionProgress = std::function<bool(CompressionStage, double)>;

/// Gives the entries of the near pairs in which leaf [0, leaves) is the column, as `solve_near` did. Called
/// by several threads at once, for each leaf in one of the processes that share the work.
using FetchNear = std::function<void(Index leaf, std::span<float> entries)>;

/// Xi of the stored dofs as a HierarchicalMatrix.
///
/// Near pairs are entries of Xi, exact but for their rounding to single. Of each cluster some dofs, its
/// skeleton, are chosen by a pivoted QR of what random loads on all that is far from it do to it, and the
/// rows of V say how the others follow them; the coupling of a far pair is then the block of Xi between two
/// skeletons. What loads on the near do is taken off with the near pairs and, going up the tree, with the
/// couplings of each level, so that the same random loads serve all levels (Boukaram and others, arXiv
/// 2506.16759). Bases and couplings that are too fine so far are recompressed at last. The result does
/// not depend on who shares the work.
class Compression {
 public:
  /// `stored_dofs` [d N] are dofs of K, d a node, in the order of `nodes`, -1 where held. All are kept by
  /// reference.
  Compression(const Factor& factor, std::span<const std::int64_t> stored_dofs, int dimension,
              const ClusteredNodes& nodes, Sharing& sharing, CompressionProgress progress);
  ~Compression();
  Compression(const Compression&) = delete;
  Compression& operator=(const Compression&) = delete;

  /// Solves for the near pairs in which leaf [0, leaves) is the column: pair after pair, resized. By thread
  /// `worker` in [0, jobs); different leaves at once, before `prepare`.
  void solve_near(Index leaf, int worker, std::vector<float>& entries);

  /// Takes the near pairs from `fetch`, or solves for them, and for random loads. False when `progress` said
  /// stop. Throws OutOfReach where near pairs are indefinite in single precision.
  bool prepare(const FetchNear& fetch = {});

  /// The matrix, cut off where rows of L^-1 Xi L^-T, L the roots of the leaves, are moved by at most `cut` by
  /// random loads of +-1 on all that is far (see `recompressed`). Once prepared, for any number of cuts. Null
  /// when `progress` said stop. Throws OutOfReach where a rank would be above what the random loads can tell.
  std::shared_ptr<HierarchicalMatrix> compress(double cut);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Tree and pairs of a matrix before it is made.
HierarchicalMatrix compression_frame(const ClusteredNodes& nodes, int dimension);

/// Multiplications and additions of the near pairs, from some of the leaves.
double near_flops(const Factor& factor, std::span<const std::int64_t> stored_dofs,
                  const HierarchicalMatrix& frame);

/// Bytes that one thread takes, with solves of at least so many columns beside its own.
std::int64_t compression_workspace(const Factor& factor, const HierarchicalMatrix& frame,
                                   std::int64_t columns);

}  // namespace palpate
