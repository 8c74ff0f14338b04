// Green's functions of a body that has turned and bent with a coarse field.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "runtime/core/body/coarse_field.h"
#include "runtime/core/body/greens.h"

namespace palpate {

/// Largest number of dofs of a coarse field.
inline constexpr Index most_coarse_dofs = 400;

/// Stored nodes in a coarse field.
struct CoarseNodes {
  CoarseField field;
  std::vector<CoarsePlace> place;  ///< [nodes] of the Green's functions
  std::vector<std::uint8_t> axes;  ///< [nodes] bit `axis` is set if the node is free along it
  Eigen::MatrixXd compliance;      ///< K_c^-1 of the coarse field at rest [m/N]

  [[nodiscard]] Index dofs() const noexcept { return static_cast<Index>(field.dofs()); }  ///< n_q
  /// True if a node is free along every axis: others do not turn.
  [[nodiscard]] bool turns(Index node) const noexcept {
    return axes[static_cast<std::size_t>(node)] == (field.dimension() == 3 ? 7 : 3);
  }
};

/// Change of a stored node's displacement with q, du_i = J_i dq. The field moves and turns the
/// node, and with it the remainder s: J_i = P_i - T_i [grad]_x R_i^T by coarse nodes, T_i = R_i [s_i]_x G_i.
struct CoarseTurn {
  Mat3 R = Mat3::Identity();
  Mat3 T = Mat3::Zero();
};

/// A stored node whose turning moves the remainder of others much: all of its J.
struct CoarseColumn {
  Index node;
  Eigen::MatrixXd J;  ///< [n_q x d] transposed
};

/// R_i (Xi_ij - P_i K_c^-1 P_j^T) R_j^T + J_i H^-1 J_j^T: what the coarse field leaves of Xi, turned with it,
/// and the coarse field's response by its tangent H in the present state.
struct TwoLevelState {
  std::shared_ptr<const CoarseNodes> nodes;
  std::vector<CoarseTurn> turns;        ///< [nodes]
  Eigen::MatrixXd H_inverse;            ///< [n_q x n_q] [m/N]
  std::vector<CoarseColumn> columns{};  ///< of loaded nodes
  std::vector<Index>
      near{};  ///< nodes between which the coarse field's part is found now and not by each `gather`
};

/// The state of a body at rest, where they are Xi.
[[nodiscard]] TwoLevelState at_rest(const std::shared_ptr<const CoarseNodes>& nodes);

/// Makes it of Xi, which may be another one for each of several.
std::shared_ptr<const Greens> two_levels(std::shared_ptr<const Greens> Xi, TwoLevelState state);

}  // namespace palpate
