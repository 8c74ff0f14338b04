// Measured effect of compression on forces.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "formats/model.h"
#include "matrices/hierarchical.h"
#include "meshes/mesh.h"
#include "precompute/numerics/factor.h"
#include "precompute/numerics/sharing.h"

namespace palpate {

/// Relative force errors of touches with `nodes` nodes.
struct TouchErrors {
  Index nodes = 0;
  std::vector<double> errors;  ///< ascending
  /// Errors of the touches' total forces divided by ErrorBound, ascending; for each touch with a bound, the
  /// largest over axes and displacements.
  std::vector<double> bound_shares{};

  [[nodiscard]] double largest_bound_share() const {
    return bound_shares.empty() ? 0.0 : bound_shares.back();
  }
  [[nodiscard]] double quantile(double share) const {
    return errors.empty() ? 0.0 : errors[static_cast<std::size_t>(share * double(errors.size() - 1))];
  }
};

/// Numbers of nodes of the measured touches.
inline constexpr std::array<Index, 4> certified_nodes = {1, 5, 30, 100};

/// Stored nodes of a body for choosing touches.
struct TouchablePoints {
  std::vector<Vec3> points;      ///< [N] of all stored nodes [m]
  std::vector<Index> touchable;  ///< stored nodes of the surface that are free along every axis
};

/// Points of `stored_nodes` [N], nodes of the model's mesh in the order of the matrix.
TouchablePoints touchable_points(const Model& model, std::span<const Index> stored_nodes);

/// Force errors of `touches` random touches for each of certified_nodes (or of all nodes, if there are
/// fewer): nodes nearest to a random node, some of those near it, and some of all, in turns. Displacements
/// and error as in touch_error; forces by the factor are found by conjugate gradients, to 1e-8. `touchable`
/// are stored nodes that are free along every axis (none: no errors), `points` [N] of all stored nodes;
/// `seed` determines the touches. `progress` gets the finished fraction and returns false to stop; the errors
/// so far are then returned.
std::vector<TouchErrors> certify(const HierarchicalMatrix& matrix, const Factor& factor,
                                 std::span<const std::int64_t> stored_dofs, std::span<const Vec3> points,
                                 std::span<const Index> touchable, std::int64_t touches, std::uint64_t seed,
                                 Sharing& sharing, const std::function<bool(double)>& progress);

}  // namespace palpate
