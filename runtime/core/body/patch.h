// Overlay in the form that the tick uses.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "base/vectors.h"

namespace palpate {

/// Patch of the body's surface with a finer mesh below it, condensed (theory.md section 4) to the data of the
/// tick, whose size below the surface does not depend on the refinement. d dofs per node; Q are the g nodes
/// of the body in the patch. The surface nodes that tools meet follow n nodes of the fine mesh on the
/// surface, by its shape functions. Constant once made; any number of threads may use it.
class Patch {
 public:
  /// A node of the fine mesh that a surface node follows.
  struct Part {
    Index node;
    double weight;
  };
  static constexpr Index most_nodes = 1024;  ///< n, if surface nodes follow several
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// Shapes as those of the members below.
  struct Parts {
    std::vector<Index> elements;
    std::vector<Index> surface_nodes;
    std::vector<Index> stored_nodes;
    std::vector<Index> first_part{};  ///< [m + 1]; empty: each surface node is a node of the fine mesh
    std::vector<Part> follows{};
    Rows compliance;
    Rows response;
    Rows correction;
    Eigen::VectorXd offset{};         ///< empty: none
    Eigen::VectorXd offset_forces{};  ///< as this
  };
  explicit Patch(Parts parts) : parts_(std::move(parts)) {}

  /// [m] surface nodes of the body (ElasticBody::simplices), ascending.
  [[nodiscard]] std::span<const Index> surface_nodes() const noexcept { return parts_.surface_nodes; }
  /// Refined elements of the body, ascending.
  [[nodiscard]] std::span<const Index> elements() const noexcept { return parts_.elements; }
  /// [g] stored nodes Q.
  [[nodiscard]] std::span<const Index> stored_nodes() const noexcept { return parts_.stored_nodes; }

  /// True if a surface node follows more than one node of the fine mesh.
  [[nodiscard]] bool is_sampled() const noexcept { return !parts_.first_part.empty(); }
  /// Number d n of dofs of the fine mesh on the surface.
  [[nodiscard]] std::ptrdiff_t fine_dofs() const noexcept { return parts_.compliance.rows(); }
  /// Calls visit(node of the fine mesh, weight) for those that the k-th surface node follows.
  template <class Visit>
  void for_each_part(Index k, Visit&& visit) const noexcept {
    if (!is_sampled()) return visit(k, 1.0);
    const auto at = static_cast<std::size_t>(k);
    for (auto p = static_cast<std::size_t>(parts_.first_part[at]);
         p < static_cast<std::size_t>(parts_.first_part[at + 1]); ++p)
      visit(parts_.follows[p].node, parts_.follows[p].weight);
  }

  /// Row [d n] of the compliance between nodes of the fine mesh, T Xi_G,QQ T^T + K_L^-1 [m/N], of dof
  /// d k + axis for the k-th node.
  [[nodiscard]] const double* compliance(Index dof) const noexcept {
    return parts_.compliance.row(dof).data();
  }
  /// Row [d g] of H = T (I + Xi_QQ M): displacement of a dof of the fine mesh by the displacement of Q that
  /// forces outside the patch cause without the overlay. Conversely, forces f on the surface nodes act on the
  /// rest of the body as H^T f on Q without the overlay.
  [[nodiscard]] const double* response(Index dof) const noexcept { return parts_.response.row(dof).data(); }
  /// Row [d g] of M [N/m]: forces on Q that represent the overlay, beside forces elsewhere (Overlay).
  [[nodiscard]] const double* correction(Index dof) const noexcept {
    return parts_.correction.row(dof).data();
  }

  /// True if it is displaced without forces, as patches from a tangent are; otherwise the next two are empty.
  [[nodiscard]] bool has_offset() const noexcept { return parts_.offset.size() > 0; }
  /// [d n] displacement of the fine mesh's dofs under no forces [m].
  [[nodiscard]] const Eigen::VectorXd& offset() const noexcept { return parts_.offset; }
  /// [d g] forces on Q that, without the overlay, cause the displacement of the rest of the body under no
  /// forces [N].
  [[nodiscard]] const Eigen::VectorXd& offset_forces() const noexcept { return parts_.offset_forces; }

  /// Memory use [byte].
  [[nodiscard]] std::size_t bytes() const noexcept;

 private:
  Parts parts_;
};

}  // namespace palpate
