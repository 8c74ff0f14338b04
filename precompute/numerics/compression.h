// Xi in nested low-rank form, from the factor, without ever having all of it.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "formats/hierarchical.h"
#include "precompute/numerics/cluster_pairs.h"
#include "precompute/numerics/factor.h"

namespace palpate {

/// What decides how good and how large the compressed matrix is.
struct CompressionOptions {
  /// Where low rank is cut off: of D^-1/2 Xi D^-1/2, D the diagonal of Xi, times random loads of +-1 on all
  /// that is far [-].
  double cut = 1e-2;
  Index samples = most_rank;  ///< random loads
  int jobs = 1;               ///< threads; the result does not depend on it
};

/// The parts that a compression has.
enum class CompressionStage : std::uint8_t { near, samples, far };

/// Told which share of a part is done; false stops.
using CompressionProgress = std::function<bool(CompressionStage, double)>;

/// Xi of the stored dofs as a HierarchicalMatrix. `stored_dofs` [d N] are dofs of K, d a node, in the order
/// of `nodes`, -1 where held.
///
/// Near pairs and the couplings of far ones are entries of Xi, exact but for their rounding to single. What
/// is cut off is in the bases: of each cluster some dofs, its skeleton, are chosen by a pivoted QR of what
/// random loads on all that is far from it do to it, and the rows of V say how the others follow them. What
/// loads on the near do is taken off with the near pairs and, going up the tree, with the couplings of each
/// level, so that the same random loads serve all levels (Boukaram and others, arXiv 2506.16759).
///
/// Nothing when `progress` said stop. Throws Error where a rank would be above what the samples can tell.
std::optional<HierarchicalMatrix> compress(const Factor& factor, std::span<const std::int64_t> stored_dofs,
                                           int dimension, const ClusteredNodes& nodes,
                                           const CompressionOptions& options,
                                           const CompressionProgress& progress);

}  // namespace palpate
